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
class Step:
    """One cycle on one scale."""

    reduction: int
    """Size of the images: 1 is full, 2 half, 4 a quarter."""
    cycle: int
    """The cycle on that scale, counted from 0."""
    foods: int
    """Food sources of each pixel's colony."""
    iterations: int
    """Rounds of bees."""


@dataclass(frozen=True)
class StateInfo:
    """What a state is."""

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
    """Copies of a state's maps."""

    depth: NDArray[np.float32]
    """0 where there is none."""
    normal: NDArray[np.float32]
    cost: NDArray[np.float32]
    """The aggregated cost of the search."""
    validated: NDArray[np.bool_]
    """Where the check validated the solution."""


class State:
    """What is known of one view after it was searched in a step or, once checked, after the check. Never changes."""

    __slots__ = ("_handle", "size")

    def __init__(self, handle: Any, size: tuple[int, int]) -> None:
        self._handle = handle
        self.size = size
        """Width and height of the maps."""

    @staticmethod
    def load(steps: Steps, saved: bytes) -> State:
        """A state that was saved by the same version of the library, for steps of the same scene and options."""
        given = ffi.from_buffer("uint8_t[]", saved)
        return steps._take(lambda out: lib.skep_state_load(steps._handle, given, len(given), out))

    @staticmethod
    def from_maps(
        steps: Steps,
        step: int,
        view: int,
        depth: ArrayLike,
        normal: ArrayLike,
        validated: ArrayLike | None = None,
        cost: ArrayLike | None = None,
    ) -> State:
        """A state from the caller's own maps, as if it had been checked in `step`, of the size `Steps.size` tells.

        `validated` is true where the solution counts as such; None validates all that have a depth.
        """
        width, height = steps.size(step, view)
        shape = (height, width)
        judged = None if validated is None else np.asarray(validated, dtype=bool).view(np.uint8)
        maps = [
            rows(depth, np.float32, shape, "depth"),
            rows(normal, np.float32, (*shape, 3), "normal"),
            None if judged is None else rows(judged, np.uint8, shape, "validated"),
            None if cost is None else rows(cost, np.float32, shape, "cost"),
        ]
        flat = [part for given in maps for part in ((ffi.NULL, 0) if given is None else given[:2])]
        return steps._take(lambda out: lib.skep_state_from_maps(steps._handle, step, view, *flat, out))

    def save(self) -> bytes:
        """The state as bytes, to keep it or to send it to another machine."""
        size = ffi.new("size_t *")
        check(lib.skep_state_save(self._handle, ffi.NULL, 0, size))
        buffer = ffi.new("uint8_t[]", size[0])
        check(lib.skep_state_save(self._handle, buffer, size[0], size))
        return bytes(ffi.buffer(buffer))

    @property
    def info(self) -> StateInfo:
        """What the state is."""
        found = ffi.new("skep_state_info *")
        check(lib.skep_state_get_info(self._handle, found))
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
        check(lib.skep_state_get_maps(self._handle, *arrays, depth.size))
        return StateMaps(depth, normal, cost, validated.view(np.bool_))


class Offers:
    """Planes that other views offer to the pixels of a view. Never changes."""

    __slots__ = ("_handle",)

    def __init__(self, handle: Any) -> None:
        self._handle = handle


class Steps:
    """A run taken apart; `len(steps)` is the number of steps at most.

    For step 0, and then for what `next` says until that is None:
    - when the step is on a finer scale than the states, `hand_up` each of them;
    - `propagate`, then `search` each view, all from the states the step before left;
    - `check` each view against what all have just found: that is what the next step starts from.

    After the last, `finish` each view, and `fuse` the validated maps. That gives the same bits as `reconstruct`. Steps
    of different views may be taken at the same time from several threads. States are passed as a list with one entry
    for each view of the scene, None for a view of which nothing is known; an empty list knows of none.
    """

    __slots__ = ("_handle", "view_count", "_steps")

    def __init__(self, scene: Scene, options: Options | None = None) -> None:
        out = ffi.new("skep_steps **")
        check(lib.skep_steps_create(scene._handle, _options.handle(options), out))
        self._handle = ffi.gc(out[0], lib.skep_steps_destroy)
        steps, views = ffi.new("uint32_t *"), ffi.new("uint32_t *")
        check(lib.skep_steps_get_count(self._handle, steps, views))
        self.view_count: int = views[0]
        self._steps = tuple(self._step(step) for step in range(steps[0]))

    def _step(self, step: int) -> Step:
        found = ffi.new("skep_step *")
        check(lib.skep_steps_get_step(self._handle, step, found))
        return Step(found.reduction, found.cycle, found.foods, found.iterations)

    def _take(self, call: Callable[[Any], int]) -> State:
        out = ffi.new("skep_state **")
        check(call(out))
        return self._state(ffi.gc(out[0], lib.skep_state_destroy))

    def _state(self, handle: Any) -> State:
        info = ffi.new("skep_state_info *")
        check(lib.skep_state_get_info(handle, info))
        return State(handle, self.size(info.step, info.view))

    def __len__(self) -> int:
        return len(self._steps)

    def __getitem__(self, step: int) -> Step:
        return self._steps[step]

    def size(self, step: int, view: int) -> tuple[int, int]:
        """Width and height of a view's maps at a step."""
        width, height = ffi.new("uint32_t *"), ffi.new("uint32_t *")
        numbers = index(step, "step"), index(view, "view")
        check(lib.skep_steps_get_size(self._handle, *numbers, width, height))
        return width[0], height[0]

    def sources(self, view: int) -> tuple[int, ...]:
        """The source views of a view: those whose states its steps look at."""
        index(view, "view")
        return take_indices(lambda *out: lib.skep_steps_get_sources(self._handle, view, *out))

    def propagate(self, step: int, view: int, states: Sequence[State | None]) -> Offers:
        """The planes that other views offer to a view where it has no validated one; from checked states."""
        out = ffi.new("skep_offers **")
        numbers = index(step, "step"), index(view, "view")
        check(lib.skep_steps_propagate(self._handle, *numbers, *_array(states), out))
        return Offers(ffi.gc(out[0], lib.skep_offers_destroy))

    def search(
        self,
        step: int,
        view: int,
        states: Sequence[State | None] = (),
        offers: Offers | None = None,
        progress: ProgressFunction | None = None,
    ) -> State:
        """Searches a view for one cycle, from checked states on the step's scale; gives one still to be checked.

        `progress` as in `reconstruct`.
        """
        known = tuple(states)
        offered = ffi.NULL if offers is None else offers._handle
        numbers = index(step, "step"), index(view, "view")
        search = lib.skep_steps_search
        call = lambda *hook: search(self._handle, *numbers, *_array(known), offered, *hook)
        return self._state(run(call, "skep_state", progress))

    def check(self, step: int, view: int, states: Sequence[State | None]) -> State:
        """Checks a view's solutions against what its sources have just found; from states that `search` gave."""
        numbers = index(step, "step"), index(view, "view")
        return self._take(lambda out: lib.skep_steps_check(self._handle, *numbers, *_array(states), out))

    def hand_up(self, step: int, view: int, state: State) -> State:
        """A checked state on the next finer scale, that of `step`."""
        numbers = index(step, "step"), index(view, "view")
        return self._take(lambda out: lib.skep_steps_hand_up(self._handle, *numbers, state._handle, out))

    def next(self, step: int, states: Sequence[State | None]) -> int | None:
        """The step to take after `step` was taken for all views, from its checked states; None after the last."""
        following = ffi.new("uint32_t *")
        check(lib.skep_steps_next(self._handle, index(step, "step"), *_array(states), following))
        return None if following[0] == lib.SKEP_STEP_NONE else following[0]

    def finish(
        self, view: int, states: Sequence[State | None], progress: ProgressFunction | None = None
    ) -> ResultView:
        """Averages planes with those of the source views, closes small gaps, and settles source views, cost and outcome
        of every pixel after the last step; from checked states."""
        known = tuple(states)
        number = index(view, "view")
        finish = lib.skep_steps_finish
        call = lambda *hook: finish(self._handle, number, *_array(known), *hook)
        return ResultView(run(call, "skep_result", progress), number)


def _array(states: Sequence[State | None]) -> tuple[Any, int]:
    """States as C takes them; the caller keeps them alive."""
    handles = [ffi.NULL if state is None else state._handle for state in states]
    return ffi.new("skep_state *[]", handles), len(handles)
