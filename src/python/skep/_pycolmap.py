"""Scenes from pycolmap, which need not be installed for anything else."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from ._camera import Camera
from ._errors import ArgumentError, FileError
from ._scene import Scene


def from_pycolmap(
    reconstruction: Any, image_folder: str | os.PathLike[str], depth_range: tuple[float, float] | None = None
) -> Scene:
    """A scene of a `pycolmap.Reconstruction`: its images that have a pose, in the order of their ids, and its
    points.

    The cameras must be PINHOLE or SIMPLE_PINHOLE; `pycolmap.undistort_images` makes them so. `depth_range` is
    that of every view; None takes it from the points.
    """
    import pycolmap

    scene = Scene()
    numbers: dict[int, int] = {}
    for image_id, image in sorted(reconstruction.images.items()):
        if not image.has_pose:
            continue
        file = os.path.join(image_folder, image.name)
        bitmap = pycolmap.Bitmap.read(file, as_rgb=True) if os.path.isfile(file) else None
        if bitmap is None:
            raise FileError(f"{file}: cannot be read as an image")
        camera = _camera(reconstruction.cameras[image.camera_id], image)
        pixels = bitmap.to_array()
        numbers[image_id] = scene.add_view(pixels, camera, name=image.name, depth_range=depth_range)
    positions, views = [], []
    for _, point in sorted(reconstruction.points3D.items()):
        seen = {numbers[element.image_id] for element in point.track.elements if element.image_id in numbers}
        positions.append(point.xyz)
        views.append(sorted(seen))
    scene.add_points(np.reshape(positions, (-1, 3)), views)
    return scene


def _camera(camera: Any, image: Any) -> Camera:
    if camera.model.name not in ("PINHOLE", "SIMPLE_PINHOLE"):
        remedy = "must be PINHOLE or SIMPLE_PINHOLE, as pycolmap.undistort_images makes them"
        raise ArgumentError(f"camera {camera.camera_id} is {camera.model.name}: {remedy}")
    K = np.array(camera.calibration_matrix())
    # COLMAP has the center of the top-left pixel at (0.5, 0.5).
    K[:2, 2] -= 0.5
    world_to_camera = np.array(image.cam_from_world().matrix())
    return Camera(K, world_to_camera[:, :3], world_to_camera[:, 3])
