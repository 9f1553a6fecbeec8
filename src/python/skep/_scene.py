"""Calibrated photographs and sparse points."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _options
from ._buffers import (
    doubles,
    index,
    indices,
    pointer,
    rows,
    take_indices,
    take_text,
    text,
    until_refused,
)
from ._buffers import path as to_path
from ._camera import Camera
from ._errors import ArgumentError, check
from ._images import Order, image as to_image
from ._native import ffi, lib
from ._objects import NotPickled
from ._options import Options
from ._run import ProgressFunction, run


class Scene(NotPickled):
    """Calibrated photographs and sparse points; `len(scene)` is the number of views.

    A run uses the scene as it was when the run started. A copy by `copy.copy` shares the photographs, and
    changes by itself.
    """

    __slots__ = ("_handle",)

    _handle: Any
    _instead = "send the arguments of add_view, or a folder of write_colmap for read"

    def __init__(self) -> None:
        out = ffi.new("skep_scene **")
        check(lib.skep_scene_create(out))
        self._handle = ffi.gc(out[0], lib.skep_scene_destroy)

    @classmethod
    def read(
        cls,
        path: str | os.PathLike[str],
        depth_range: tuple[float, float] | None = None,
        options: Options | None = None,
        progress: ProgressFunction | None = None,
    ) -> Scene:
        """Reads a scene of any format into memory: COLMAP, nerfstudio, OpenMVS, MVSNet, OpenSfM, Middlebury.

        `depth_range` is that of every view; None derives it from the scene. Photographs are undistorted; the
        options `input.*` choose, reduce and mask them. `warnings` has what was found out. `progress` is told of the
        photographs that are read, as in `reconstruct`.
        """
        near, far = depth_range or (0.0, 0.0)
        place, chosen = to_path(path, "path"), _options.handle(options)

        def call(callback: Any, user: Any, out: Any) -> Any:
            return lib.skep_scene_read(place, chosen, near, far, callback, user, out)

        scene = cls.__new__(cls)
        scene._handle = run(call, "skep_scene", progress)
        return scene

    @classmethod
    def _of(cls, out: Any) -> Scene:
        scene = cls.__new__(cls)
        scene._handle = ffi.gc(out[0], lib.skep_scene_destroy)
        return scene

    def __copy__(self) -> Scene:
        out = ffi.new("skep_scene **")
        check(lib.skep_scene_copy(self._handle, out))
        return self._of(out)

    def __deepcopy__(self, _: Any) -> Scene:
        return self.__copy__()

    def write_colmap(self, folder: str | os.PathLike[str]) -> None:
        """Writes a folder that COLMAP and `read` read; photographs are PNG files whatever their names."""
        check(lib.skep_scene_write_colmap(self._handle, to_path(folder, "folder")))

    def add_view(
        self,
        image: NDArray[Any],
        camera: Camera,
        *,
        name: str | None = None,
        order: Order = "rgb",
        white: float | None = None,
        mask: NDArray[Any] | None = None,
        depth_range: tuple[float, float] | None = None,
    ) -> int:
        """Adds a photograph, which is copied, and returns its number.

        `image` has shape (height, width) or (height, width, 1, 3 or 4) and type uint8, uint16 or float32;
        `order` is that of its channels. Rows may lie apart, as in a part of a larger image.

        `white` is the value of white: None takes 255 for uint8, 65535 for uint16 and 1 for float32. Pass 255
        for float32 from 0 to 255, and 4095 for 12 bits in uint16. Values outside 0 to `white` are refused,
        except for those by up to 1/255 of it, which are clamped. An image of uint16 without any value above
        4095 is a warning unless `white` is given.
        """
        given = to_image(image, order, white)
        # An added view cannot be removed: everything that can fail is checked before.
        if mask is not None:
            _mask_rows(mask, given.array.shape[:2])
        if depth_range is not None:
            _try_depth_range(depth_range, camera)
        view = ffi.new("uint32_t *")
        label = ffi.NULL if name is None else text(name, "name")
        check(lib.skep_scene_add_view(self._handle, label, given.struct, camera.to_c(), view))
        number: int = view[0]
        if mask is not None:
            self.set_mask(number, mask)
        if depth_range is not None:
            self.set_depth_range(number, depth_range)
        return number

    def set_mask(self, view: int, mask: NDArray[Any] | None) -> None:
        """Sets the mask of a view: true or not 0 where depths are estimated; None removes it.

        Masked pixels still serve as sources for other views.
        """
        if mask is None:
            check(lib.skep_scene_set_mask(self._handle, index(view, "view"), ffi.NULL, 0))
            return
        width, height = self.size(view)
        given = _mask_rows(mask, (height, width))
        check(lib.skep_scene_set_mask(self._handle, view, given.pointer, given.stride))

    def set_depth_range(self, view: int, depth_range: tuple[float, float] | None) -> None:
        """Sets the depth range of a view; None derives it from the sparse points, which is the default."""
        near, far = depth_range or (0.0, 0.0)
        check(lib.skep_scene_set_depth_range(self._handle, index(view, "view"), near, far))

    def set_sources(self, view: int, sources: Iterable[int] | None) -> None:
        """Sets the source views of a view, the most important first; they may be added later.

        None selects them by triangulation angle, the default.
        """
        given = indices(sources or (), "sources")
        check(lib.skep_scene_set_sources(self._handle, index(view, "view"), pointer(given), given.size))

    def add_points(self, positions: ArrayLike, views: Sequence[Iterable[int]]) -> None:
        """Adds sparse points of shape (n, 3) with the views that saw each of them, which may be added later.

        Depth ranges and source views are derived from the points; without any, give each view a depth range.
        """
        points = doubles(positions, (-1, 3), "positions")
        lists = [indices(seen, "views") for seen in views]
        if len(lists) != len(points):
            raise ArgumentError(
                f"views are {len(lists)} lists: must be one for each of the {len(points)} points"
            )
        counts = np.array([seen.size for seen in lists], dtype=np.uint32)
        flat = np.concatenate(lists) if lists else np.zeros(0, dtype=np.uint32)
        check(
            lib.skep_scene_add_points(
                self._handle, pointer(points), len(points), pointer(counts), pointer(flat), flat.size
            )
        )

    def validate(self) -> None:
        """Checks the scene as a run would."""
        check(lib.skep_scene_validate(self._handle))

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about the scene for its user, such as depth ranges that no sparse point supports. Those
        about source views, which depend on the options, are in `Result.warnings`.
        """
        self.validate()
        ask = lib.skep_scene_get_warning
        warning = lambda number: take_text(lambda *out: ask(self._handle, number, *out))
        return tuple(until_refused(warning))

    def __len__(self) -> int:
        count = ffi.new("uint32_t *")
        check(lib.skep_scene_get_view_count(self._handle, count))
        number: int = count[0]
        return number

    def __repr__(self) -> str:
        return f"<skep.Scene of {len(self)} views>"

    def size(self, view: int) -> tuple[int, int]:
        """Width and height."""
        width, height = ffi.new("uint32_t *"), ffi.new("uint32_t *")
        check(lib.skep_scene_get_view(self._handle, index(view, "view"), width, height, ffi.NULL))
        return width[0], height[0]

    def camera(self, view: int) -> Camera:
        """A view's camera."""
        camera = ffi.new("skep_camera *")
        check(lib.skep_scene_get_view(self._handle, index(view, "view"), ffi.NULL, ffi.NULL, camera))
        return Camera.from_c(camera)

    def name(self, view: int) -> str:
        """A view's name in messages and files."""
        index(view, "view")
        return take_text(lambda *out: lib.skep_scene_get_name(self._handle, view, *out))

    def depth_range(self, view: int) -> tuple[float, float]:
        """The depth range that a run searches: the view's own, or the one derived from the sparse points.

        Beyond a derived one a small part of the search goes on, to 0.7 times its near and 4 times its far end.
        """
        near, far = ffi.new("double *"), ffi.new("double *")
        check(lib.skep_scene_get_depth_range(self._handle, index(view, "view"), near, far))
        return near[0], far[0]

    def sources(self, view: int, options: Options | None = None) -> tuple[int, ...]:
        """The source views a run with these options would match a view with."""
        index(view, "view")
        chosen = _options.handle(options)
        return take_indices(lambda *out: lib.skep_scene_get_sources(self._handle, chosen, view, *out))

    def overlap(self, view: int) -> tuple[int, ...]:
        """The views that fusion compares with a view: those that share a sparse point with it.

        A view that shares none with any other is compared with all others and they with it; of more than
        1,000 views, with the 256 whose cameras are the nearest.
        """
        index(view, "view")
        return take_indices(lambda *out: lib.skep_scene_get_overlap(self._handle, view, *out))

    def triangulation_angle(self, reference: int, source: int) -> float | None:
        """The angle of two views in degrees; None when they share no surface."""
        degrees = ffi.new("double *")
        views = index(reference, "reference"), index(source, "source")
        check(lib.skep_scene_get_triangulation_angle(self._handle, *views, degrees))
        return None if degrees[0] < 0 else degrees[0]


def _mask_rows(mask: NDArray[Any], shape: tuple[int, ...]) -> Any:
    given = np.asarray(mask)
    return rows(given.view(np.uint8) if given.dtype == bool else given, np.uint8, shape, "mask")


def _try_depth_range(depth_range: tuple[float, float], camera: Camera) -> None:
    trial = Scene()
    trial.add_view(np.zeros((1, 1), dtype=np.uint8), camera)
    trial.set_depth_range(0, depth_range)
