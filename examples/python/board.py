"""Depth, normals, source views and reasons of a scene, and its cloud from the side, as pictures.

    python board.py [--quick] [SCENE [PICTURES]]

SCENE holds images/ and a COLMAP model in sparse/. `--quick` takes seconds and shows less.
"""

# %% Where things are
import sys
from pathlib import Path

import matplotlib
import numpy as np

import skep

matplotlib.use("Agg")
from matplotlib import pyplot

quick = "--quick" in sys.argv
places = [Path(argument) for argument in sys.argv[1:] if argument != "--quick"]
folder = places[0] if places else Path(__file__).parent / "../data/board"
pictures = places[1] if len(places) > 1 else Path("pictures")
pictures.mkdir(parents=True, exist_ok=True)

# %% The scene: photographs, cameras and sparse points
scene = skep.Scene.read(folder)
for view in range(len(scene)):
    near, far = scene.depth_range(view)
    print(
        f"{scene.name(view)}: {scene.size(view)}, depth {near:.2f} to {far:.2f}, "
        f"sources {scene.sources(view)}"
    )

# %% The run; Ctrl-C stops it
options = skep.Options()
if quick:
    options.schedule_scales = (
        "downscale=4 food_sources=4 iterations=6+3x1; "
        "downscale=2 food_sources=3 iterations=2+1x1; "
        "downscale=1 food_sources=2 iterations=0+1x1"
    )
    options.view_selection_max_sources = options.cost_max_views_per_pixel = options.cost_best_views = 3


def print_progress(progress: skep.Progress) -> None:
    print(f"\r{progress.done:4.0%}", end="", flush=True)


result = skep.reconstruct(scene, options, print_progress)
print(f"\r{len(result.cloud)} points", *result.warnings, sep="\n")

# %% The maps of a view: raw ones are the library's own memory, validated ones are copies
view = result[0]
depth = np.where(view.validated_depth > 0, view.validated_depth, np.nan)
panels = {
    "depth, validated": (depth, "turbo"),
    "normals, raw": ((view.normal * [1, -1, -1] + 1) / 2, None),
    "source views of each pixel": (view.source_count, "viridis"),
    "why pixels are empty": (view.status, matplotlib.colormaps["Set2"].resampled(len(skep.PixelStatus))),
}
figure, axes = pyplot.subplots(2, 2, figsize=(12, 8), layout="constrained")
for axis, (title, (values, colors)) in zip(axes.flat, panels.items()):
    low, high = (-0.5, len(skep.PixelStatus) - 0.5) if "why" in title else (None, None)
    shown = axis.imshow(values, cmap=colors, vmin=low, vmax=high)
    axis.set(title=title, xticks=[], yticks=[])
    if "why" in title:
        names = [status.name.lower().replace("_", " ") for status in skep.PixelStatus]
        figure.colorbar(shown, ax=axis, shrink=0.7).set_ticks(list(skep.PixelStatus), labels=names)
    elif colors:
        figure.colorbar(shown, ax=axis, shrink=0.7)
figure.savefig(pictures / "maps.png", dpi=80)

# %% The cloud from the side: 50 degrees from where the first camera stands
cloud = result.cloud
x, y, z = scene.camera(0).R @ (cloud.positions - np.median(cloud.positions, axis=0)).T
sine, cosine = np.sin(np.radians(50)), np.cos(np.radians(50))
across, away = cosine * x + sine * z, cosine * z - sine * x
order = np.argsort(-away)
figure, axis = pyplot.subplots(figsize=(8, 6), layout="constrained")
axis.scatter(across[order], y[order], c=cloud.colors[order] / 255, s=0.5, linewidths=0)
(left, right), (top, bottom) = np.percentile(across, [1, 99]), np.percentile(y, [1, 99])
axis.set(title=f"{len(cloud)} points", aspect="equal", xlim=(left, right), ylim=(bottom, top))
figure.savefig(pictures / "cloud.png", dpi=80)
print(f"pictures are in {pictures}")
