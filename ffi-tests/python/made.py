"""A synthetic scene with exact depths and normals: a textured ball in front of a tilted, textured wall."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import skep

WIDTH, HEIGHT, FOCAL = 96, 72, 100.0
PLACES = [(0, 0), (0.9, 0), (-0.9, 0), (0, 0.9), (0, -0.9), (0.8, 0.7)]
DISTANCE = 4.0
DEPTH_RANGE = (2.5, 6.5)
NOISE = np.random.default_rng(1).random((32, 32, 32, 3))
BALL, RADIUS = np.array([0.1, 0.0, -0.2]), 0.6
WALL = np.array([0.25, 0.1, -1.0]) / np.linalg.norm([0.25, 0.1, -1.0])
WALL_DISTANCE = 0.7


@dataclass(frozen=True)
class Photograph:
    camera: skep.Camera
    image: np.ndarray
    depth: np.ndarray
    normal: np.ndarray


# A run of a fraction of a second.
TWO_SCALES = "downscale=2 food_sources=3 iterations=2+1x1; downscale=1 food_sources=3 iterations=1+1x1"


def camera_at(x: float, y: float) -> skep.Camera:
    """A camera that looks at the world's origin."""
    center = np.array([x, y, -DISTANCE])
    forward = -center / np.linalg.norm(center)
    right = np.cross([0.0, 1.0, 0.0], forward)
    right /= np.linalg.norm(right)
    R = np.array([right, np.cross(forward, right), forward])
    K = [[FOCAL, 0, WIDTH / 2 - 0.7], [0, FOCAL * 1.01, HEIGHT / 2 + 0.4], [0, 0, 1]]
    return skep.Camera(K, R, -R @ center)


def rays(camera: skep.Camera, columns: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Directions in the world whose length along the camera's axis is 1."""
    x = (columns - camera.K[0, 2]) / camera.K[0, 0]
    y = (rows - camera.K[1, 2]) / camera.K[1, 1]
    return np.stack([x, y, np.ones_like(x)], axis=-1) @ camera.R


def cast(
    camera: skep.Camera, columns: np.ndarray, rows: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Depth, position and normal in the world of what is seen through pixels."""
    origin, direction = camera.center, rays(camera, columns, rows)
    wall = (-WALL_DISTANCE - origin @ WALL) / (direction @ WALL)
    towards = origin - BALL
    a, b = (direction**2).sum(-1), direction @ towards
    root = b**2 - a * (towards @ towards - RADIUS**2)
    ball = np.where(root > 0, (-b - np.sqrt(np.maximum(root, 0))) / a, np.inf)
    depth = np.minimum(wall, ball)
    position = origin + depth[..., None] * direction
    normal = np.where((ball < wall)[..., None], (position - BALL) / RADIUS, WALL)
    return depth, position, normal


def texture(position: np.ndarray) -> np.ndarray:
    """Several octaves of noise over the world's positions, 0 to 1."""
    color = np.zeros(position.shape)
    for cell, share in ((0.5, 0.3), (0.22, 0.3), (0.1, 0.4)):
        place = position / cell + 100
        corner = np.floor(place).astype(int)
        part = place - corner
        for x, y, z in np.ndindex(2, 2, 2):
            weight = np.abs([1 - x, 1 - y, 1 - z] - part).prod(-1)
            at = (corner + [x, y, z]) % 32
            color += share * weight[..., None] * NOISE[at[..., 0], at[..., 1], at[..., 2]]
    return np.clip(2 * color - 0.5, 0, 1)


@cache
def photographs() -> tuple[Photograph, ...]:
    found = []
    columns, rows = np.meshgrid(np.arange(WIDTH, dtype=float), np.arange(HEIGHT, dtype=float))
    for place in PLACES:
        camera = camera_at(*place)
        depth, _, normal = cast(camera, columns, rows)
        parts = [(x, y) for x in (-0.25, 0.25) for y in (-0.25, 0.25)]
        color = np.mean([texture(cast(camera, columns + x, rows + y)[1]) for x, y in parts], axis=0)
        found.append(Photograph(camera, np.round(255 * color).astype(np.uint8), depth, normal @ camera.R.T))
    return tuple(found)


def points() -> tuple[np.ndarray, list[list[int]]]:
    """Exact surface points, with the views that see them."""
    found = photographs()
    positions, views = [], []
    columns, rows = np.meshgrid(np.arange(4.0, WIDTH, 8), np.arange(4.0, HEIGHT, 8))
    for position in cast(found[0].camera, columns, rows)[1].reshape(-1, 3):
        seen = []
        for number, photograph in enumerate(found):
            camera = photograph.camera
            x, y, depth = camera.K @ (camera.R @ position + camera.t)
            column, row = round(x / depth), round(y / depth)
            inside = 0 <= column < WIDTH and 0 <= row < HEIGHT
            if inside and abs(photograph.depth[row, column] - depth) < 0.02 * depth:
                seen.append(number)
        if len(seen) >= 2:
            positions.append(position)
            views.append(seen)
    return np.array(positions), views


def scene() -> skep.Scene:
    """Without sparse points: each view has the depth range."""
    made = skep.Scene()
    for photograph in photographs():
        made.add_view(photograph.image, photograph.camera, depth_range=DEPTH_RANGE)
    return made


def options(**values: skep._options.Value) -> skep.Options:
    """Three views see every point, and small images make a pixel much depth."""
    strict = {
        "fusion_min_agreeing_views": 2,
        "fusion_min_agreeing_fraction": 0,
        "check_few_views": 0,
        "check_reprojection_tolerance": 0,
    }
    return skep.Options(**{"threads": 2, **strict, **values})


def slow_options() -> skep.Options:
    """A run of many minutes, to be stopped."""
    return skep.Options(
        "paper", schedule_scales="downscale=1 food_sources=64 iterations=10000+0x0", threads=2
    )


def scene_folder(folder: Path) -> Path:
    """The scene with exact points as files."""
    made = scene()
    made.add_points(*points())
    made.write_colmap(folder)
    return folder


def results(folder: Path) -> dict[str, bytes]:
    """The files of a run that its tasks write."""
    found = {str(path.relative_to(folder)): path for path in folder.rglob("*") if path.is_file()}
    ours = {name: path for name, path in found.items() if not name.startswith(("run/", "report."))}
    return {name: path.read_bytes() for name, path in ours.items()}
