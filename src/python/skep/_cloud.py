"""Fused points, and fusion by itself."""

from __future__ import annotations

import importlib
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _options
from ._buffers import indices, path, pointer, rows
from ._camera import Camera
from ._errors import ArgumentError, check
from ._images import Order, image as to_image
from ._native import ffi, lib
from ._objects import SentAsArrays
from ._options import Options
from ._run import ProgressFunction, run


class Cloud(SentAsArrays):
    """Fused points; `len(cloud)` is their number. Arrays are copied when they are first asked for."""

    _sent = ("_count", "_view_total", "positions", "normals", "colors", "_lists")

    def __init__(self, handle: Any) -> None:
        self._handle = handle
        count, total = ffi.new("size_t *"), ffi.new("size_t *")
        check(lib.skep_cloud_get_count(handle, count, total))
        self._count: int = count[0]
        self._view_total: int = total[0]

    def __len__(self) -> int:
        return self._count

    def __repr__(self) -> str:
        return f"<skep.Cloud of {len(self)} points>"

    def _points(self, position: int, dtype: Any) -> NDArray[Any]:
        points = np.empty((len(self), 3), dtype=dtype)
        arrays = [ffi.NULL] * 3
        arrays[position] = pointer(points)
        check(lib.skep_cloud_get_points(self._handle, *arrays, len(self)))
        return points

    @cached_property
    def positions(self) -> NDArray[np.float64]:
        """x, y, z of each point in the world."""
        return self._points(0, np.float64)

    @cached_property
    def normals(self) -> NDArray[np.float32]:
        """The unit normal of each point in the world."""
        return self._points(1, np.float32)

    @cached_property
    def colors(self) -> NDArray[np.uint8]:
        """Red, green and blue of each point; 128 where no picture was given."""
        return self._points(2, np.uint8)

    @cached_property
    def _lists(self) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
        counts, flat = np.empty(len(self), dtype=np.uint32), np.empty(self._view_total, dtype=np.uint32)
        check(lib.skep_cloud_get_views(self._handle, pointer(counts), counts.size, pointer(flat), flat.size))
        return counts, flat

    @property
    def view_counts(self) -> NDArray[np.uint32]:
        """The number of views each point was fused from."""
        return self._lists[0]

    @property
    def views(self) -> NDArray[np.uint32]:
        """The views of each point, the one it started in first, point after point: `view_counts` of them
        each.
        """
        return self._lists[1]

    def to_open3d(self) -> Any:
        """An `open3d.geometry.PointCloud` of the points with their normals and colors, which are copied;
        needs open3d (`pip install skep[open3d]`).
        """
        try:
            open3d = importlib.import_module("open3d")
        except ImportError as error:
            text = f"to_open3d needs open3d, which cannot be imported: {error}; pip install open3d brings it"
            raise ImportError(text) from error
        vectors = open3d.utility.Vector3dVector
        points = open3d.geometry.PointCloud(vectors(self.positions))
        points.normals = vectors(self.normals.astype(np.float64))
        points.colors = vectors(self.colors / 255.0)
        return points

    def write_ply(self, file: str | os.PathLike[str]) -> None:
        """Writes a binary PLY, and the views of each point beside it in FILE.vis, as COLMAP does."""
        check(lib.skep_cloud_write_ply(self._held("be written"), path(file, "file")))


@dataclass(frozen=True, eq=False)
class FusionView:
    """A view with maps to be fused, from skep or another source."""

    camera: Camera
    depth: NDArray[Any]
    """float32, (height, width); values other than finite numbers above 0 are no estimate."""
    normal: NDArray[Any]
    """float32, (height, width, 3), in the camera frame."""
    image: NDArray[Any] | None = None
    """For the colors, of the maps' size; None gives gray points."""
    overlap: Iterable[int] | None = None
    """The views that may see the same surface, as `Scene.overlap` returns them; None takes all others."""
    order: Order = "rgb"
    """Of the image's channels."""
    confidence: NDArray[Any] | None = None
    """float32, (height, width), 0 to 1; None is 1 everywhere."""
    white: float | None = None
    """The value of white in the image, as in `Scene.add_view`."""

    def fill(self, struct: Any, number: int, view_count: int) -> list[Any]:
        """Writes the view into C's struct; returns the objects that must live as long as it is used."""
        name = f"views[{number}]"
        shape = np.shape(self.depth)
        if len(shape) != 2 or 0 in shape:
            raise ArgumentError(f"{name}.depth has shape {shape}: must be (height, width)")
        depth = rows(self.depth, np.float32, shape, f"{name}.depth")
        normal = rows(self.normal, np.float32, (*shape, 3), f"{name}.normal")
        others = (view for view in range(view_count) if view != number)
        overlap = indices(others if self.overlap is None else self.overlap, f"{name}.overlap")
        camera = self.camera.to_c()
        image = None if self.image is None else to_image(self.image, self.order, self.white, stacklevel=4)
        struct.camera = camera
        struct.height, struct.width = shape
        struct.depth, struct.depth_stride_bytes = depth.pointer, depth.stride
        struct.normal, struct.normal_stride_bytes = normal.pointer, normal.stride
        struct.image_or_null = ffi.NULL if image is None else image.struct
        struct.overlap, struct.overlap_count = pointer(overlap), overlap.size
        confidence = None
        if self.confidence is not None:
            confidence = rows(self.confidence, np.float32, shape, f"{name}.confidence")
            struct.confidence_or_null = confidence.pointer
            struct.confidence_stride_bytes = confidence.stride
        return [camera, depth, normal, overlap, image, confidence]


def fuse(
    views: Sequence[FusionView], options: Options | None = None, progress: ProgressFunction | None = None
) -> Cloud:
    """Fuses maps into points, with the "fusion." options and "threads"; `progress` as in `reconstruct`."""
    structs = ffi.new("skep_fusion_view[]", len(views))
    alive = []
    for number, view in enumerate(views):
        alive.append(view.fill(structs[number], number, len(views)))
    chosen = _options.handle(options)

    def call(*hook: Any) -> int:
        status: int = lib.skep_fuse(structs, len(alive), chosen, *hook)
        return status

    return Cloud(run(call, "skep_cloud", progress))
