"""Long calls: progress and cancellation.

The library calls back from threads of its own, where Python handles no signals, and while the calling thread
waits in C it handles none either. So the call runs in a thread of its own, and the calling thread waits in
Python: there it calls the progress function, and a signal's handler can raise, as KeyboardInterrupt does,
which stops the call.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, IntEnum
from typing import Any, Final

from ._errors import check
from ._native import ffi, lib


class Phase(IntEnum):
    """Stage of a call."""

    SEARCH = lib.SKEP_PHASE_SEARCH
    CHECK = lib.SKEP_PHASE_CHECK
    FUSION = lib.SKEP_PHASE_FUSION
    READ = lib.SKEP_PHASE_READ


@dataclass(frozen=True)
class Progress:
    """Progress of a call."""

    done: float
    """Fraction of the work of the call that is done, 0 to 1."""
    phase: Phase
    downscale: int
    """Size of the images searched: 1 is full, 2 half, 4 a quarter."""
    cycle: int
    """The cycle on this scale, counted from 0."""
    view: int
    """The current view."""
    view_count: int


class Cancel(Enum):
    """The type of `CANCEL`, which a progress function returns to cancel the call."""

    CANCEL = "cancel"

    def __repr__(self) -> str:
        return "skep.CANCEL"


CANCEL: Final = Cancel.CANCEL

ProgressFunction = Callable[[Progress], object]
"""Called in the thread that made the call, with the latest progress. The call is cancelled when it returns
`CANCEL`, and then raises `Cancelled`, or when it raises an exception, which the call raises too. Any other
result is ignored, also a true one: functions that show progress may return what they like."""


class _Call:
    """A call under way in its own thread."""

    def __init__(self, call: Callable[..., int], kind: str) -> None:
        self.changed = threading.Condition()
        self.latest: Progress | None = None
        self.cancelled = False
        self.ended = False
        self.found: Any = None
        self.failure: BaseException | None = None
        # Not a daemon: the interpreter must not end while the library uses it.
        self.thread = threading.Thread(target=self.make, args=(call, kind), name="skep")

    def make(self, call: Callable[..., int], kind: str) -> None:
        callback = ffi.callback("skep_progress_fn", self.receive, error=1)
        out = [ffi.new(f"{kind} **")] if kind else []
        try:
            # Here, because the text of an error is kept for the thread that made the call.
            check(call(callback, ffi.NULL, *out))
            if out:
                self.found = ffi.gc(out[0][0], getattr(lib, f"{kind}_destroy"))
        except BaseException as failure:
            self.failure = failure
        with self.changed:
            self.ended = True
            self.changed.notify()

    def receive(self, _user: Any, progress: Any) -> int:
        with self.changed:
            self.latest = Progress(
                done=progress.done,
                phase=Phase(progress.phase),
                downscale=progress.downscale,
                cycle=progress.cycle,
                view=progress.view,
                view_count=progress.view_count,
            )
            self.changed.notify()
            return int(self.cancelled)

    def report(self, function: ProgressFunction) -> None:
        """Calls the progress function with the latest progress until the call ends or is cancelled."""
        while not self.cancelled:
            with self.changed:
                while self.latest is None and not self.ended:
                    self.changed.wait()
                progress, self.latest = self.latest, None
            if progress is None:
                return
            if function(progress) is CANCEL:
                self.cancelled = True


def run(call: Callable[..., int], kind: str, progress: ProgressFunction | None) -> Any:
    """Runs `call(progress_function, user, out)` and waits until it has ended; returns the object of this kind
    that it created, or raises its error.
    """
    under_way = _Call(call, kind)
    try:
        under_way.thread.start()
        under_way.report(progress or (lambda _: None))
    except BaseException:
        under_way.cancelled = True
        raise
    finally:
        _join(under_way.thread)
    if under_way.failure is not None:
        raise under_way.failure
    return under_way.found


def run_plain(call: Callable[..., int], progress: ProgressFunction | None) -> None:
    """Runs `call(progress_function, user)`, which creates no object, and waits until it has ended; raises its
    error.
    """
    run(call, "", progress)


def _join(thread: threading.Thread) -> None:
    """Waits for the end of a call, also when signal handlers raise meanwhile."""
    interruption: BaseException | None = None
    while thread.is_alive():
        try:
            thread.join()
        except BaseException as another:
            interruption = another
    if interruption is not None:
        raise interruption
