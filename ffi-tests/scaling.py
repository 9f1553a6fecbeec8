#!/usr/bin/env python3
"""Measures how time and memory grow with the number of views and with their size, preset fast, and draws both.

    scaling.py SKEP OUT.svg [--views 16,32,64] [--megapixels 0.3,0.75,1.5] [--memory SIZE]

One axis at a time: views of 640x480, and 6 views. Beside each run, the reference (the smallest of its axis) runs
again, so that a machine that drifts shows. Needs Pillow and matplotlib.
"""

import argparse
import json
import pathlib
import resource
import subprocess
import sys
import tempfile

import matplotlib

matplotlib.use("svg")
from matplotlib import pyplot

HERE = pathlib.Path(__file__).resolve().parent


def measure(skep: str, folder: pathlib.Path, views: int, size: tuple[int, int], memory: str | None) -> dict:
    """Counts of one run, for each pixel."""
    scene, run = folder / f"scene-{views}-{size[0]}", folder / "run"
    if not scene.is_dir():
        of = ["--views", str(views), "--size", f"{size[0]}x{size[1]}"]
        subprocess.run([sys.executable, HERE / "large_scene.py", scene, *of], check=True)
    command = [skep, "reconstruct", scene, "--output", run, "--preset", "fast", "--quiet", "--fresh"]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command + (["--memory", memory] if memory else []), check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    totals = json.loads((run / "report.json").read_text())["totals"]
    pixels = totals["pixels"]
    subprocess.run(["rm", "-rf", run], check=True)
    return {
        "views": views,
        "megapixels": size[0] * size[1] / 1e6,
        "cpu": (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime) / pixels * 1e6,
        "wall": totals["wall_seconds"] / pixels * 1e6,
        "ncc": totals["ncc_evaluations"] / pixels,
        "samples": totals["bilinear_samples"] / pixels,
        "memory": totals["peak_resident_bytes"],
        "pixels": pixels,
    }


def axis(arguments: argparse.Namespace, folder: pathlib.Path, points: list[tuple[int, tuple[int, int]]]) -> list:
    """Measures the points of an axis, each with the first again beside it."""
    rows = []
    for views, size in points:
        row = measure(arguments.skep, folder, views, size, arguments.memory)
        reference = measure(arguments.skep, folder, *points[0], arguments.memory)
        row["relative"] = row["cpu"] / reference["cpu"]
        rows.append(row)
        print(
            f"{views} views of {row['megapixels']:.2f} megapixels: {row['cpu']:.1f} CPU s and {row['wall']:.1f} s a "
            f"megapixel ({row['relative']:.2f} of the reference beside it), {row['ncc']:.1f} NCC and "
            f"{row['samples']:.0f} samples a pixel, {row['memory'] / 1e6:.0f} MB "
            f"({row['memory'] / row['pixels']:.0f} B a pixel)",
            flush=True,
        )
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("skep")
    parser.add_argument("plot", type=pathlib.Path)
    parser.add_argument("--views", default="16,32,64,128,256,512")
    parser.add_argument("--megapixels", default="0.3,0.75,1.5,3,6,12,24")
    parser.add_argument("--memory")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        views = [(int(count), (640, 480)) for count in arguments.views.split(",")]
        by_views = axis(arguments, folder, views)
        sides = [round((float(size) * 1e6 / 12) ** 0.5) for size in arguments.megapixels.split(",")]
        by_size = axis(arguments, folder, [(6, (4 * side, 3 * side)) for side in sides])

    figure, plots = pyplot.subplots(2, 2, figsize=(9, 6), layout="constrained")
    for column, (rows, key, label) in enumerate(
        [(by_views, "views", "views of 640x480"), (by_size, "megapixels", "megapixels of 6 views")]
    ):
        x = [row[key] for row in rows]
        plots[0][column].semilogx(x, [row["relative"] for row in rows], "o-")
        plots[0][column].set(ylim=(0, 1.5), ylabel="CPU time a pixel, relative to the first")
        plots[1][column].loglog(x, [row["memory"] / 1e6 for row in rows], "o-")
        plots[1][column].set(xlabel=label, ylabel="peak memory, MB")
    figure.savefig(arguments.plot)


if __name__ == "__main__":
    main()
