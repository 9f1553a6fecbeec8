"""The stages of a run on single views, for hosts that schedule views themselves or have maps of their own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _options
from ._buffers import index, pointer, rows, take_indices
from ._errors import check
from ._native import ffi, lib
from ._objects import Immutable, NotPickled
from ._options import Options
from ._result import ResultView
from ._run import ProgressFunction, run
from ._scene import Scene


@dataclass(frozen=True)
class Cycle:
    """One cycle on one scale."""

    downscale: int
    """Size of the images: 1 is full, 2 half, 4 a quarter."""
    cycle_on_scale: int
    """The cycle on that scale, counted from 0."""
    food_sources: int
    """Food sources of each pixel's colony."""
    iterations: int
    """Passes of employed, onlooker and scout bees."""


@dataclass(frozen=True)
class EstimateInfo:
    """Identity and numbers of an estimate."""

    view: int
    cycle: int
    """The cycle it was searched in, or the cycle to whose scale it was upsampled."""
    is_checked: bool
    """Whether `Stepper.check` has been applied."""
    pixels: int
    changed: int
    """Pixels whose depth the last search changed by more than 0.1 %."""
    validated: int
    """Pixels that the last check validated."""
    ncc_evaluations: int
    """NCC evaluations of the view so far."""


@dataclass(frozen=True, eq=False)
class EstimateMaps:
    """Copies of the maps of an estimate."""

    depth: NDArray[np.float32]
    """0 where there is none."""
    normal: NDArray[np.float32]
    cost: NDArray[np.float32]
    """The aggregated cost of the search."""
    validated: NDArray[np.bool_]
    """Where the check validated the plane."""


class Estimate(Immutable, NotPickled):
    """The maps of one view after `Stepper.search` or `Stepper.check`. Never changes."""

    __slots__ = ("_handle", "size")

    _instead = "send estimate.save(), for Estimate.load with a stepper of the same scene and options"

    def __init__(self, handle: Any, size: tuple[int, int]) -> None:
        self._handle = handle
        self.size = size
        """Width and height of the maps."""

    @staticmethod
    def load(stepper: Stepper, saved: bytes) -> Estimate:
        """Loads an estimate that the same version of the library saved, for a stepper of the same scene and
        options.
        """
        given = ffi.from_buffer("uint8_t[]", saved)
        return stepper._take(lambda out: lib.skep_estimate_load(stepper._handle, given, len(given), out))

    @staticmethod
    def from_maps(
        stepper: Stepper,
        cycle: int,
        view: int,
        depth: ArrayLike,
        normal: ArrayLike,
        validated: ArrayLike | None = None,
        cost: ArrayLike | None = None,
    ) -> Estimate:
        """Makes a checked estimate of `cycle` from the caller's own maps, which have the size `Stepper.size`
        returns.

        `depth` in world units, 0 where there is none; `normal` (height, width, 3), unit, in the camera frame,
        facing the camera. `validated` is true where the plane counts as validated; None validates every
        depth. `cost` ranks the planes in the propagation to other views; None is 0.
        """
        width, height = stepper.size(cycle, view)
        shape = (height, width)
        flags = None if validated is None else np.asarray(validated, dtype=bool).view(np.uint8)
        maps = [
            rows(depth, np.float32, shape, "depth"),
            rows(normal, np.float32, (*shape, 3), "normal"),
            None if flags is None else rows(flags, np.uint8, shape, "validated"),
            None if cost is None else rows(cost, np.float32, shape, "cost"),
        ]
        flat = [part for given in maps for part in ((ffi.NULL, 0) if given is None else given[:2])]
        return stepper._take(
            lambda out: lib.skep_estimate_from_maps(stepper._handle, cycle, view, *flat, out)
        )

    def save(self) -> bytes:
        """The estimate as bytes, to keep it or to send it to another machine."""
        size = ffi.new("size_t *")
        check(lib.skep_estimate_save(self._handle, ffi.NULL, 0, size))
        buffer = ffi.new("uint8_t[]", size[0])
        check(lib.skep_estimate_save(self._handle, buffer, size[0], size))
        return bytes(ffi.buffer(buffer))

    @property
    def info(self) -> EstimateInfo:
        """Identity and numbers of the estimate."""
        found = ffi.new("skep_estimate_info *")
        check(lib.skep_estimate_get_info(self._handle, found))
        return EstimateInfo(
            found.view,
            found.cycle,
            bool(found.is_checked),
            found.pixels,
            found.changed,
            found.validated,
            found.ncc_evaluations,
        )

    def __repr__(self) -> str:
        info, (width, height) = self.info, self.size
        stage = "checked" if info.is_checked else "searched"
        return f"<skep.Estimate of view {info.view}, {stage} in cycle {info.cycle}, {width} x {height}>"

    def maps(self) -> EstimateMaps:
        """Copies of all maps."""
        shape = self.size[::-1]
        depth, cost = np.empty(shape, dtype=np.float32), np.empty(shape, dtype=np.float32)
        normal, validated = np.empty((*shape, 3), dtype=np.float32), np.empty(shape, dtype=np.uint8)
        arrays = (pointer(array) for array in (depth, normal, cost, validated))
        check(lib.skep_estimate_get_maps(self._handle, *arrays, depth.size))
        return EstimateMaps(depth, normal, cost, validated.view(np.bool_))


class Candidates(Immutable, NotPickled):
    """Planes of other views, transferred to the pixels of a view. Never changes."""

    __slots__ = ("_handle",)

    _instead = "send the estimates with Estimate.save, and call Stepper.propagate there"

    def __init__(self, handle: Any) -> None:
        self._handle = handle


class Stepper(Immutable, NotPickled):
    """The stages of a run on single views; `len(stepper)` is the largest number of cycles.

    For cycle 0, and then for the cycle that `next` returns until that is None:
    - if the cycle is on a finer scale than the estimates, `upsample` each of them;
    - `propagate` and `search` each view, from the checked estimates of the previous cycle;
    - `check` each view against the searched estimates of the same cycle.

    After the last cycle, `finish` each view and `fuse` the validated maps. That gives the same bits as
    `reconstruct`. Different views may be processed at the same time from several threads. Lists of estimates
    have one entry for each view of the scene, None where there is no estimate; an empty list has none.
    """

    __slots__ = ("_handle", "view_count", "_cycles")

    _instead = "send its scene and options, and make a stepper of them there"

    def __init__(self, scene: Scene, options: Options | None = None) -> None:
        out = ffi.new("skep_stepper **")
        check(lib.skep_stepper_create(scene._handle, _options.handle(options), out))
        self._handle = ffi.gc(out[0], lib.skep_stepper_destroy)
        cycles, views = ffi.new("uint32_t *"), ffi.new("uint32_t *")
        check(lib.skep_stepper_get_count(self._handle, cycles, views))
        self.view_count: int = views[0]
        self._cycles = tuple(self._cycle(cycle) for cycle in range(cycles[0]))

    def _cycle(self, cycle: int) -> Cycle:
        found = ffi.new("skep_cycle *")
        check(lib.skep_stepper_get_cycle(self._handle, cycle, found))
        return Cycle(found.downscale, found.cycle_on_scale, found.food_sources, found.iterations)

    def _take(self, call: Callable[[Any], int]) -> Estimate:
        out = ffi.new("skep_estimate **")
        check(call(out))
        return self._wrap(ffi.gc(out[0], lib.skep_estimate_destroy))

    def _wrap(self, handle: Any) -> Estimate:
        info = ffi.new("skep_estimate_info *")
        check(lib.skep_estimate_get_info(handle, info))
        return Estimate(handle, self.size(info.cycle, info.view))

    def __len__(self) -> int:
        return len(self._cycles)

    def __getitem__(self, cycle: int) -> Cycle:
        return self._cycles[cycle]

    def __repr__(self) -> str:
        return f"<skep.Stepper of {self.view_count} views, {len(self)} cycles at most>"

    def size(self, cycle: int, view: int) -> tuple[int, int]:
        """Width and height of a view's maps in a cycle."""
        width, height = ffi.new("uint32_t *"), ffi.new("uint32_t *")
        numbers = index(cycle, "cycle"), index(view, "view")
        check(lib.skep_stepper_get_size(self._handle, *numbers, width, height))
        return width[0], height[0]

    def sources(self, view: int) -> tuple[int, ...]:
        """The source views of a view."""
        index(view, "view")
        return take_indices(lambda *out: lib.skep_stepper_get_sources(self._handle, view, *out))

    def propagate(self, cycle: int, view: int, estimates: Sequence[Estimate | None]) -> Candidates:
        """Transfers consistent planes of the views whose source lists contain the view to its pixels without
        a validated plane; from the checked estimates of the previous cycle."""
        out = ffi.new("skep_candidates **")
        numbers = index(cycle, "cycle"), index(view, "view")
        check(lib.skep_stepper_propagate(self._handle, *numbers, *_array(estimates), out))
        return Candidates(ffi.gc(out[0], lib.skep_candidates_destroy))

    def search(
        self,
        cycle: int,
        view: int,
        estimates: Sequence[Estimate | None] = (),
        candidates: Candidates | None = None,
        progress: ProgressFunction | None = None,
    ) -> Estimate:
        """Searches the planes of a view for one cycle and fills textureless regions; the result is to be
        checked.

        From checked estimates of the previous cycle, on the scale of this one: reads the view's own and the
        validated surfaces of its sources. `progress` as in `reconstruct`.
        """
        known = tuple(estimates)
        planes = ffi.NULL if candidates is None else candidates._handle
        numbers = index(cycle, "cycle"), index(view, "view")
        search = lib.skep_stepper_search
        call = lambda *hook: search(self._handle, *numbers, *_array(known), planes, *hook)
        return self._wrap(run(call, "skep_estimate", progress))

    def check(self, cycle: int, view: int, estimates: Sequence[Estimate | None]) -> Estimate:
        """Checks a view against the searched estimates of its sources, of the same cycle.

        Changes depths and normals too: after the consistency check it corrects foreground fattening (where
        the scale may end with this cycle), smooths planes, and publishes the validated surface.
        """
        numbers = index(cycle, "cycle"), index(view, "view")
        return self._take(lambda out: lib.skep_stepper_check(self._handle, *numbers, *_array(estimates), out))

    def upsample(self, cycle: int, view: int, estimate: Estimate) -> Estimate:
        """A checked estimate on the next finer scale, that of `cycle`: each pixel gets the plane of its
        coarse pixel.
        """
        numbers = index(cycle, "cycle"), index(view, "view")
        return self._take(
            lambda out: lib.skep_stepper_upsample(self._handle, *numbers, estimate._handle, out)
        )

    def next(self, cycle: int, estimates: Sequence[Estimate | None]) -> int | None:
        """The cycle after `cycle`, from its checked estimates; None after the last.

        A scale ends early when few pixels changed (option "schedule.min_changed_fraction").
        """
        following = ffi.new("uint32_t *")
        check(lib.skep_stepper_next(self._handle, index(cycle, "cycle"), *_array(estimates), following))
        return None if following[0] == lib.SKEP_CYCLE_NONE else following[0]

    def finish(
        self, view: int, estimates: Sequence[Estimate | None], progress: ProgressFunction | None = None
    ) -> ResultView:
        """Averages planes across views, fills small gaps, and determines view set, cost and status of every
        pixel.

        From the checked estimates of the last cycle.
        """
        known = tuple(estimates)
        number = index(view, "view")
        finish = lib.skep_stepper_finish
        call = lambda *hook: finish(self._handle, number, *_array(known), *hook)
        return ResultView(run(call, "skep_result", progress), number)


def _array(estimates: Sequence[Estimate | None]) -> tuple[Any, int]:
    """Estimates for C; the caller keeps them alive."""
    handles = [ffi.NULL if estimate is None else estimate._handle for estimate in estimates]
    return ffi.new("skep_estimate *[]", handles), len(handles)
