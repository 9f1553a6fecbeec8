"""A run taken apart, for hosts that schedule views themselves or bring maps of their own."""

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
from ._options import Options
from ._result import ResultView
from ._run import ProgressFunction, run
from ._scene import Scene


@dataclass(frozen=True)
class Cycle:
    """One cycle on one scale."""

    downscale: int
    """Size of the images: 1 is full, 2 half, 4 a quarter."""
    cycle: int
    """The cycle on that scale, counted from 0."""
    foods: int
    """Food sources of each pixel's colony."""
    iterations: int
    """Rounds of bees."""


@dataclass(frozen=True)
class StateInfo:
    """What a estimate is."""

    view: int
    step: int
    """The step it was searched in, or whose scale it was handed up to."""
    is_checked: bool
    """Whether it carries the verdicts of a check."""
    pixels: int
    changed: int
    """Pixels whose solution the last search changed."""
    validated: int
    """Pixels the last check validated."""
    ncc_evaluations: int
    """Spent on the view so far."""


@dataclass(frozen=True, eq=False)
class StateMaps:
    """Copies of a estimate's maps."""

    depth: NDArray[np.float32]
    """0 where there is none."""
    normal: NDArray[np.float32]
    cost: NDArray[np.float32]
    """The aggregated cost of the search."""
    validated: NDArray[np.bool_]
    """Where the check validated the solution."""


class Estimate:
    """What is known of one view after it was searched in a step or, once checked, after the check. Never changes."""

    __slots__ = ("_handle", "size")

    def __init__(self, handle: Any, size: tuple[int, int]) -> None:
        self._handle = handle
        self.size = size
        """Width and height of the maps."""

    @staticmethod
    def load(stepper: Stepper, saved: bytes) -> Estimate:
        """A estimate that was saved by the same version of the library, for stepper of the same scene and options."""
        given = ffi.from_buffer("uint8_t[]", saved)
        return stepper._take(lambda out: lib.skep_estimate_load(stepper._handle, given, len(given), out))

    @staticmethod
    def from_maps(
        stepper: Stepper,
        step: int,
        view: int,
        depth: ArrayLike,
        normal: ArrayLike,
        validated: ArrayLike | None = None,
        cost: ArrayLike | None = None,
    ) -> Estimate:
        """A estimate from the caller's own maps, as if it had been checked in `step`, of the size `Stepper.size` tells.

        `validated` is true where the solution counts as such; None validates all that have a depth.
        """
        width, height = stepper.size(step, view)
        shape = (height, width)
        judged = None if validated is None else np.asarray(validated, dtype=bool).view(np.uint8)
        maps = [
            rows(depth, np.float32, shape, "depth"),
            rows(normal, np.float32, (*shape, 3), "normal"),
            None if judged is None else rows(judged, np.uint8, shape, "validated"),
            None if cost is None else rows(cost, np.float32, shape, "cost"),
        ]
        flat = [part for given in maps for part in ((ffi.NULL, 0) if given is None else given[:2])]
        return stepper._take(lambda out: lib.skep_estimate_from_maps(stepper._handle, step, view, *flat, out))

    def save(self) -> bytes:
        """The estimate as bytes, to keep it or to send it to another machine."""
        size = ffi.new("size_t *")
        check(lib.skep_estimate_save(self._handle, ffi.NULL, 0, size))
        buffer = ffi.new("uint8_t[]", size[0])
        check(lib.skep_estimate_save(self._handle, buffer, size[0], size))
        return bytes(ffi.buffer(buffer))

    @property
    def info(self) -> StateInfo:
        """What the estimate is."""
        found = ffi.new("skep_estimate_info *")
        check(lib.skep_estimate_get_info(self._handle, found))
        return StateInfo(
            found.view,
            found.step,
            bool(found.is_checked),
            found.pixels,
            found.changed,
            found.validated,
            found.ncc_evaluations,
        )

    def maps(self) -> StateMaps:
        """Copies of all maps."""
        shape = self.size[::-1]
        depth, cost = np.empty(shape, dtype=np.float32), np.empty(shape, dtype=np.float32)
        normal, validated = np.empty((*shape, 3), dtype=np.float32), np.empty(shape, dtype=np.uint8)
        arrays = (pointer(array) for array in (depth, normal, cost, validated))
        check(lib.skep_estimate_get_maps(self._handle, *arrays, depth.size))
        return StateMaps(depth, normal, cost, validated.view(np.bool_))


class Candidates:
    """Planes that other views offer to the pixels of a view. Never changes."""

    __slots__ = ("_handle",)

    def __init__(self, handle: Any) -> None:
        self._handle = handle


class Stepper:
    """A run taken apart; `len(stepper)` is the number of stepper at most.

    For step 0, and then for what `next` says until that is None:
    - when the step is on a finer scale than the estimates, `upsample` each of them;
    - `propagate`, then `search` each view, all from the estimates the step before left;
    - `check` each view against what all have just found: that is what the next step starts from.

    After the last, `finish` each view, and `fuse` the validated maps. That gives the same bits as `reconstruct`. Stepper
    of different views may be taken at the same time from several threads. States are passed as a list with one entry
    for each view of the scene, None for a view of which nothing is known; an empty list knows of none.
    """

    __slots__ = ("_handle", "view_count", "_stepper")

    def __init__(self, scene: Scene, options: Options | None = None) -> None:
        out = ffi.new("skep_stepper **")
        check(lib.skep_stepper_create(scene._handle, _options.handle(options), out))
        self._handle = ffi.gc(out[0], lib.skep_stepper_destroy)
        stepper, views = ffi.new("uint32_t *"), ffi.new("uint32_t *")
        check(lib.skep_stepper_get_count(self._handle, stepper, views))
        self.view_count: int = views[0]
        self._stepper = tuple(self._step(step) for step in range(stepper[0]))

    def _step(self, step: int) -> Cycle:
        found = ffi.new("skep_cycle *")
        check(lib.skep_stepper_get_cycle(self._handle, step, found))
        return Cycle(found.downscale, found.cycle, found.foods, found.iterations)

    def _take(self, call: Callable[[Any], int]) -> Estimate:
        out = ffi.new("skep_estimate **")
        check(call(out))
        return self._state(ffi.gc(out[0], lib.skep_estimate_destroy))

    def _state(self, handle: Any) -> Estimate:
        info = ffi.new("skep_estimate_info *")
        check(lib.skep_estimate_get_info(handle, info))
        return Estimate(handle, self.size(info.step, info.view))

    def __len__(self) -> int:
        return len(self._stepper)

    def __getitem__(self, step: int) -> Cycle:
        return self._stepper[step]

    def size(self, step: int, view: int) -> tuple[int, int]:
        """Width and height of a view's maps at a step."""
        width, height = ffi.new("uint32_t *"), ffi.new("uint32_t *")
        numbers = index(step, "step"), index(view, "view")
        check(lib.skep_stepper_get_size(self._handle, *numbers, width, height))
        return width[0], height[0]

    def sources(self, view: int) -> tuple[int, ...]:
        """The source views of a view: those whose estimates its stepper look at."""
        index(view, "view")
        return take_indices(lambda *out: lib.skep_stepper_get_sources(self._handle, view, *out))

    def propagate(self, step: int, view: int, estimates: Sequence[Estimate | None]) -> Candidates:
        """The planes that other views offer to a view where it has no validated one; from checked estimates."""
        out = ffi.new("skep_candidates **")
        numbers = index(step, "step"), index(view, "view")
        check(lib.skep_stepper_propagate(self._handle, *numbers, *_array(estimates), out))
        return Candidates(ffi.gc(out[0], lib.skep_candidates_destroy))

    def search(
        self,
        step: int,
        view: int,
        estimates: Sequence[Estimate | None] = (),
        candidates: Candidates | None = None,
        progress: ProgressFunction | None = None,
    ) -> Estimate:
        """Searches a view for one cycle, from checked estimates on the step's scale; gives one still to be checked.

        `progress` as in `reconstruct`.
        """
        known = tuple(estimates)
        offered = ffi.NULL if candidates is None else candidates._handle
        numbers = index(step, "step"), index(view, "view")
        search = lib.skep_stepper_search
        call = lambda *hook: search(self._handle, *numbers, *_array(known), offered, *hook)
        return self._state(run(call, "skep_estimate", progress))

    def check(self, step: int, view: int, estimates: Sequence[Estimate | None]) -> Estimate:
        """Checks a view's solutions against what its sources have just found; from estimates that `search` gave."""
        numbers = index(step, "step"), index(view, "view")
        return self._take(lambda out: lib.skep_stepper_check(self._handle, *numbers, *_array(estimates), out))

    def upsample(self, step: int, view: int, estimate: Estimate) -> Estimate:
        """A checked estimate on the next finer scale, that of `step`."""
        numbers = index(step, "step"), index(view, "view")
        return self._take(lambda out: lib.skep_stepper_upsample(self._handle, *numbers, estimate._handle, out))

    def next(self, step: int, estimates: Sequence[Estimate | None]) -> int | None:
        """The step to take after `step` was taken for all views, from its checked estimates; None after the last."""
        following = ffi.new("uint32_t *")
        check(lib.skep_stepper_next(self._handle, index(step, "step"), *_array(estimates), following))
        return None if following[0] == lib.SKEP_CYCLE_NONE else following[0]

    def finish(
        self, view: int, estimates: Sequence[Estimate | None], progress: ProgressFunction | None = None
    ) -> ResultView:
        """Averages planes with those of the source views, closes small gaps, and settles source views, cost and status
        of every pixel after the last step; from checked estimates."""
        known = tuple(estimates)
        number = index(view, "view")
        finish = lib.skep_stepper_finish
        call = lambda *hook: finish(self._handle, number, *_array(known), *hook)
        return ResultView(run(call, "skep_result", progress), number)


def _array(estimates: Sequence[Estimate | None]) -> tuple[Any, int]:
    """States as C takes them; the caller keeps them alive."""
    handles = [ffi.NULL if estimate is None else estimate._handle for estimate in estimates]
    return ffi.new("skep_estimate *[]", handles), len(handles)
