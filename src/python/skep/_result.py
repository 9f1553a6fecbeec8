"""Whole runs and their results."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _options
from ._buffers import borrow, index, path, pointer, take_indices, take_text, until_refused
from ._cloud import Cloud
from ._errors import ArgumentError, check
from ._native import ffi, lib
from ._objects import SentAsArrays
from ._options import Options
from ._run import ProgressFunction, run
from ._scene import Scene


class PixelStatus(IntEnum):
    """Status of a pixel: validated, or the reason why it is not."""

    VALIDATED = lib.SKEP_PIXEL_VALIDATED
    """The plane is consistent with enough source views."""
    MASKED = lib.SKEP_PIXEL_MASKED
    """The mask excludes the pixel."""
    NO_TEXTURE = lib.SKEP_PIXEL_NO_TEXTURE
    """The variance in the window around the pixel is too small for matching."""
    NO_SOURCES = lib.SKEP_PIXEL_NO_SOURCES
    """No plane, or one visible in fewer than two source views (one with `check.min_consistent_views` = 1)."""
    INCONSISTENT = lib.SKEP_PIXEL_INCONSISTENT
    """Too few source views are consistent with the plane."""
    OUT_OF_RANGE = lib.SKEP_PIXEL_OUT_OF_RANGE
    """The depth is at an end of the depth range: the surface may lie outside of it."""


@dataclass(frozen=True)
class Statistics:
    """Work spent on a view and status of its pixels. The numbers do not depend on the machine."""

    ncc_evaluations: int
    """Comparisons of a patch with its image in one source view."""
    bilinear_samples: int
    """Bilinear samples taken from source views."""
    early_terminations: int
    """Plane evaluations that ended before all source views were compared."""
    status_counts: Mapping[PixelStatus, int]
    """Number of pixels of each status."""


@dataclass(frozen=True)
class CycleRecord:
    """The search and the check of one view in one cycle."""

    downscale: int
    """Size of the images: 1 is full, 2 half, 4 a quarter."""
    cycle: int
    """The cycle on that scale, counted from 0."""
    pixels: int
    """Pixels searched."""
    changed: int
    """Pixels whose depth changed by more than 0.1 %."""
    validated: int
    """Pixels validated by the check after it."""
    median_residual: float
    """Median distance, in pixels of that size, between where planes project to in the source views and where
    the source views' own depths lie."""


class ResultView(SentAsArrays):
    """The maps of one view.

    Most programs want `validated_depth` and `validated_normal`: `depth` and `normal` hold the raw estimate of
    every pixel, right or wrong. `status` says of each pixel why it is not validated, and
    `statistics.status_counts` how many there are of each kind.

    Raw maps are read-only arrays of the result's own memory, which lives as long as they do; the others are
    copies, made at the first access. A view that was pickled holds copies of all. All are numpy arrays, which
    other libraries take without a copy: `torch.from_dlpack(view.validated_depth)`; of raw maps some want a
    copy, `view.depth.copy()`, as they are read-only.
    """

    _sent = (
        "view",
        "size",
        "depth",
        "normal",
        "cost",
        "confidence",
        "status",
        "source_count",
        "sources",
        "statistics",
        "cycles",
        "_source_words",
    )

    def __init__(self, handle: Any, view: int) -> None:
        self._handle = handle
        self.view = view
        """The view's number in the scene."""
        width, height = ffi.new("uint32_t *"), ffi.new("uint32_t *")
        check(lib.skep_result_get_size(handle, index(view, "view"), width, height))
        self.size: tuple[int, int] = (width[0], height[0])
        """Width and height of the maps."""

    def __repr__(self) -> str:
        return f"<skep.ResultView of view {self.view}, {self.size[0]} x {self.size[1]}>"

    def _borrow(self, function: Any, c_type: str, dtype: Any, *channels: int) -> NDArray[Any]:
        address = ffi.new(f"const {c_type} **")
        check(function(self._handle, self.view, address))
        return borrow(self._handle, address[0], dtype, (*self.size[::-1], *channels))

    def _copy(self, function: Any, which: tuple[int, ...], dtype: Any, *channels: int) -> NDArray[Any]:
        copied = np.empty((*self.size[::-1], *channels), dtype=dtype)
        check(function(self._handle, self.view, *which, pointer(copied), copied.strides[0]))
        return copied

    @cached_property
    def depth(self) -> NDArray[np.float32]:
        """The raw depth of every pixel in world units, right or wrong, 0 where there is no estimate; (height,
        width). `validated_depth` leaves out what no source views confirm.
        """
        return self._borrow(lib.skep_result_borrow_depth, "float", np.float32)

    @cached_property
    def normal(self) -> NDArray[np.float32]:
        """Raw unit normals in the view's camera frame, facing the camera, zeros where none; (height, width,
        3).
        """
        return self._borrow(lib.skep_result_borrow_normal, "float", np.float32, 3)

    @cached_property
    def cost(self) -> NDArray[np.float32]:
        """Matching cost of the raw plane of every pixel: mean of 1 - NCC over its source views, 0 to 2."""
        return self._borrow(lib.skep_result_borrow_cost, "float", np.float32)

    @cached_property
    def confidence(self) -> NDArray[np.float32]:
        """Probability that the raw depth of a pixel is within 1 % of the true one, 0 to 1; 0 without one."""
        return self._borrow(lib.skep_result_borrow_confidence, "float", np.float32)

    @cached_property
    def status(self) -> NDArray[np.uint8]:
        """Status of every pixel: values of `PixelStatus`, which say why a pixel has no validated depth.

        share = {status.name: (view.status == status).mean() for status in skep.PixelStatus}
        """
        return self._borrow(lib.skep_result_borrow_status, "uint8_t", np.uint8)

    @cached_property
    def validated_depth(self) -> NDArray[np.float32]:
        """The depth of validated pixels in world units, 0 elsewhere; `status` says why."""
        return np.where(self._is_validated, self.depth, np.float32(0))

    @cached_property
    def validated_normal(self) -> NDArray[np.float32]:
        """The normals of validated pixels, zeros elsewhere."""
        return np.where(self._is_validated[..., None], self.normal, np.float32(0))

    @property
    def _is_validated(self) -> NDArray[np.bool_]:
        validated: NDArray[np.bool_] = self.status == PixelStatus.VALIDATED
        return validated

    @cached_property
    def source_count(self) -> NDArray[np.uint16]:
        """The number of source views of every pixel."""
        return self._copy(lib.skep_result_get_source_count, (), np.uint16)

    @cached_property
    def sources(self) -> tuple[int, ...]:
        """The source views of the view, as numbers of the scene's views."""
        return take_indices(lambda *out: lib.skep_result_get_sources(self._handle, self.view, *out))

    def visible_in(self, source: int) -> NDArray[np.bool_]:
        """The pixels that have a source view of `sources` in their view set."""
        if source not in self.sources:
            raise ArgumentError(f"source is {source}: must be one of {self.sources}")
        word, bit = divmod(self.sources.index(source), 32)
        words = self._source_words[word]
        visible: NDArray[np.bool_] = (words >> np.uint32(bit)) & np.uint32(1) != 0
        return visible

    @cached_property
    def _source_words(self) -> list[NDArray[np.uint32]]:
        """A bit of every pixel for each of `sources`, 32 of them in each map."""
        words = range((len(self.sources) + 31) // 32)
        return [self._copy(lib.skep_result_get_source_bits, (word,), np.uint32) for word in words]

    @cached_property
    def statistics(self) -> Statistics:
        """Work spent on the view and status of its pixels."""
        found = ffi.new("skep_statistics *")
        check(lib.skep_result_get_statistics(self._handle, self.view, found))
        counts = {status: found.status_counts[status] for status in PixelStatus}
        return Statistics(found.ncc_evaluations, found.bilinear_samples, found.early_terminations, counts)

    @cached_property
    def cycles(self) -> tuple[CycleRecord, ...]:
        """The cycles of the view in order."""
        count = ffi.new("size_t *")
        check(lib.skep_result_get_cycles(self._handle, self.view, ffi.NULL, 0, count))
        found = ffi.new("skep_cycle_record[]", count[0])
        check(lib.skep_result_get_cycles(self._handle, self.view, found, count[0], count))
        return tuple(
            CycleRecord(one.downscale, one.cycle, one.pixels, one.changed, one.validated, one.median_residual)
            for one in found
        )


class Result(SentAsArrays):
    """Result of a whole run: `result[view]` holds the maps of a view, `len(result)` counts the views."""

    _sent = ("views", "cloud", "warnings")

    def __init__(self, handle: Any) -> None:
        self._handle = handle
        count = ffi.new("size_t *")
        check(lib.skep_result_get_views(handle, ffi.NULL, 0, count))
        numbers = ffi.new("uint32_t[]", count[0])
        check(lib.skep_result_get_views(handle, numbers, count[0], count))
        self.views: tuple[ResultView, ...] = tuple(ResultView(handle, number) for number in numbers)

    def __len__(self) -> int:
        return len(self.views)

    def __getitem__(self, view: int) -> ResultView:
        return self.views[view]

    def __iter__(self) -> Iterator[ResultView]:
        return iter(self.views)

    def __repr__(self) -> str:
        return f"<skep.Result of {len(self)} views>"

    @cached_property
    def cloud(self) -> Cloud:
        """The fused points."""
        out = ffi.new("skep_cloud **")
        check(lib.skep_result_get_cloud(self._handle, out))
        return Cloud(ffi.gc(out[0], lib.skep_cloud_destroy))

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """Warnings of the run for its user, such as views without any source view."""
        ask = lib.skep_result_get_warning
        warning = lambda number: take_text(lambda *out: ask(self._handle, number, *out))
        return tuple(until_refused(warning))

    def to_open3d(self) -> Any:
        """The fused points for open3d, as `Cloud.to_open3d` makes them."""
        return self.cloud.to_open3d()

    def write_workspace(self, scene: Scene, folder: str | os.PathLike[str]) -> None:
        """Writes COLMAP's dense folder without images/ and sparse/, which `Scene.write_colmap`
        writes.
        """
        held = self._held("be written")
        check(lib.skep_result_write_workspace(held, scene._handle, path(folder, "folder")))


def reconstruct(
    scene: Scene, options: Options | None = None, progress: ProgressFunction | None = None
) -> Result:
    """Estimates depth, normal and source views of every pixel of every view, and fuses the validated pixels.

    `progress` is called in this thread about a hundred times a second. The run is cancelled when it returns
    `CANCEL`, and raises `Cancelled`, or when it raises an exception, as KeyboardInterrupt, which the run
    raises too. Any other result is ignored, so `tqdm.update` may be called in it as it is.
    """
    chosen = _options.handle(options)
    call = lambda *hook: lib.skep_reconstruct(scene._handle, chosen, *hook)
    return Result(run(call, "skep_result", progress))
