#!/usr/bin/env python3
"""Makes a scene of any number of views of any size from the board in examples/data, for measurements of time
and memory: its photographs are enlarged and repeated, each repetition with slightly moved poses, so that the
work is that of real photographs while the result means nothing.

    large_scene.py FOLDER --views 256 --size 1600x900

Needs Pillow.
"""

import argparse
import math
import pathlib

from PIL import Image

BOARD = pathlib.Path(__file__).resolve().parent.parent / "examples" / "data" / "board"
MOVE = 2e-4  # of the translation, a repetition


def records(file: str) -> list[str]:
    lines = (BOARD / "sparse" / file).read_text().splitlines()
    return [line for line in lines if not line.startswith("#")]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--views", type=int, default=7)
    parser.add_argument("--size", default="640x360", metavar="WIDTHxHEIGHT")
    arguments = parser.parse_args()
    width, height = (int(side) for side in arguments.size.split("x"))
    images, sparse = arguments.folder / "images", arguments.folder / "sparse"
    images.mkdir(parents=True, exist_ok=True)
    sparse.mkdir(exist_ok=True)

    camera = records("cameras.txt")[0].split()
    scale = (width / int(camera[2]), height / int(camera[3]))
    parameters = [float(number) * scale[axis] for number, axis in zip(camera[4:], (0, 1, 0, 1))]
    numbers = " ".join(repr(number) for number in parameters)
    (sparse / "cameras.txt").write_text(f"1 PINHOLE {width} {height} {numbers}\n")

    # Every second line lists features, which only the tracks of points refer to.
    poses = [line.split() for line in records("images.txt")[0::2]]
    lines = []
    for view in range(arguments.views):
        pose, turn = poses[view % len(poses)], view // len(poses)
        name = f"{view:05d}.jpg"
        moved = [
            float(number) * (1 + MOVE * turn * math.cos(view + axis))
            for axis, number in enumerate(pose[5:8])
        ]
        lines.append(f"{view + 1} {' '.join(pose[1:5])} {' '.join(map(repr, moved))} 1 {name}\n\n")
        if turn == 0:
            photograph = Image.open(BOARD / "images" / pose[9]).convert("RGB")
            photograph.resize((width, height), Image.Resampling.BICUBIC).save(images / name, quality=92)
        else:
            (images / name).unlink(missing_ok=True)
            (images / name).hardlink_to(images / f"{view % len(poses):05d}.jpg")
    (sparse / "images.txt").write_text("".join(lines))

    points = []
    place = {pose[0]: index for index, pose in enumerate(poses)}
    for record in records("points3D.txt"):
        fields = record.split()
        track = [place[image] for image in fields[8::2]]
        repeated = [
            f"{view + 1} 0" for view in range(arguments.views) if view % len(poses) in track
        ]
        points.append(" ".join(fields[:8] + repeated) + "\n")
    (sparse / "points3D.txt").write_text("".join(points))


main()
