"""Runs on a cluster of Dask, whose workers share a folder; needs `skep[distributed]`.

    from distributed import Client
    import skep.distributed

    client = Client("tcp://scheduler:8786")
    summary = skep.distributed.reconstruct("/shared/SCENE", client, folder="/shared/RUN")

Estimates and maps go through the folder, at the same path on all machines; Dask carries only which tasks are
done. The result has the same bits as a run in one process.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import threading
import time
import uuid
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ._errors import Cancelled, FileError
from ._job import Job, Task
from ._options import Options
from ._run import CANCEL

if TYPE_CHECKING:
    from distributed import Client, Future

_MEMORY_SHARE = 0.7
"""Share of a worker's memory limit that a run keeps to. Dask starts no tasks above 0.8."""


@dataclass(frozen=True)
class Summary:
    """What a distributed run made."""

    folder: str
    """The folder with the maps and the cloud, in COLMAP's layouts."""
    points: int
    """Number of points of the cloud."""


def reconstruct(
    scene: str | os.PathLike[str],
    client: Client,
    *,
    folder: str | os.PathLike[str],
    options: Options | None = None,
    depth_range: tuple[float, float] = (0.0, 0.0),
    fresh: bool = False,
    retries: int = 2,
) -> Summary:
    """Plans the run of a COLMAP scene (images/ and sparse/) in a folder that this process and all workers
    share, and does its tasks on the workers.

    A run that began in the folder goes on, as with `Job.plan`; so the same call goes on after any failure. A
    task that fails is tried again `retries` times, and a worker that ends loses only the tasks it was doing.
    KeyboardInterrupt stops the tasks on the workers too.

    A worker process does one task at a time, on as many threads as `options.threads` says, or as the worker
    has. It keeps to a share of the worker's memory limit, or to `options.memory` if that is less. Several
    processes of few threads each use a machine better than one of many.
    """
    options = Options() if options is None else options
    folder = os.path.abspath(folder)
    # Left open by a call that was killed; they would keep the folder locked.
    client.run(_close, folder)
    # The lock of a planned run keeps the workers out.
    with Job.plan(scene, folder, options, depth_range=depth_range, fresh=fresh) as job:
        pending = _Pending.of(job)
    # Dask takes tasks with equal keys for the same task, whatever run they belong to.
    name, memory = uuid.uuid4().hex[:8], int(options["memory"])
    call = _Call(folder, name, options.threads, memory, options.simd)
    run = _Run(client, call, retries)
    try:
        return Summary(folder, run.do(pending))
    finally:
        run.close()


@dataclass(frozen=True)
class _Call:
    """What workers know of a call of `reconstruct`."""

    folder: str
    name: str
    """Different in every call."""
    threads: int
    memory: int
    simd: str


@dataclass(frozen=True)
class _Pending:
    """What is left to do of a run."""

    views_read: list[list[int]]
    """By view, the views whose files its tasks read."""
    cycle: int | None
    """The first cycle that is not done, if any."""
    done: frozenset[tuple[Task, int]]
    """Tasks of views that are done: those of the cycle, and the last ones of views."""

    @staticmethod
    def of(job: Job) -> _Pending:
        cycle = _next_cycle(job, 0)
        of_cycle = [] if cycle is None else [Task.SEARCH, Task.CHECK]
        done = frozenset(
            (task, view)
            for task in [*of_cycle, Task.FINISH]
            for view in range(job.view_count)
            if job.is_done(task, cycle=cycle or 0, view=view)
        )
        return _Pending([job.views_read(view) for view in range(job.view_count)], cycle, done)


def _next_cycle(job: Job, start: int) -> int | None:
    """The first cycle from `start` on that is neither done nor skipped."""
    cycles = range(start, job.cycle_count)
    return next((cycle for cycle in cycles if not job.is_done(Task.NEXT, cycle=cycle)), None)


class _Run:
    """A run that a client does."""

    def __init__(self, client: Client, call: _Call, retries: int) -> None:
        # Not all of its methods have types.
        self.client: Any = client
        self.call = call
        self.retries = retries
        self.futures: list[Future[Any]] = []
        self.places: dict[int, str] = {}

    def do(self, pending: _Pending) -> int:
        """Does what is left; returns the number of points."""
        cycle, done = pending.cycle, pending.done
        while cycle is not None:
            cycle = self.do_cycle(cycle, pending.views_read, done)
            # Those were of the first cycle.
            done = frozenset((task, view) for task, view in done if task == Task.FINISH)
        views = range(len(pending.views_read))
        waiting = [view for view in views if (Task.FINISH, view) not in done]
        finished = self.submit_views(Task.FINISH, 0, waiting, lambda view: [])
        return int(self.submit(_fuse, "fuse", (), list(finished.values())).result())

    def do_cycle(
        self, cycle: int, views_read: list[list[int]], done: frozenset[tuple[Task, int]]
    ) -> int | None:
        """Does a cycle; returns the one that follows."""
        views = range(len(views_read))
        waiting = [view for view in views if (Task.SEARCH, view) not in done]
        searched = self.submit_views(Task.SEARCH, cycle, waiting, lambda view: [])
        waiting = [view for view in views if (Task.CHECK, view) not in done]
        checked = self.submit_views(
            Task.CHECK,
            cycle,
            waiting,
            lambda view: [searched[other] for other in views_read[view] if other in searched],
        )
        following = self.submit(_decide, f"next-c{cycle:02}", (cycle,), list(checked.values())).result()
        self.places.update(zip(checked, self.client.gather(list(checked.values()))))
        self.futures.clear()
        return None if following is None else int(following)

    def submit_views(
        self, task: Task, cycle: int, views: Sequence[int], after: Callable[[int], list[Future[Any]]]
    ) -> dict[int, Future[Any]]:
        """Submits a task of views, each to start after some others, by preference on the worker that did the
        view before: it has the photograph and estimates of the view and some neighbors in memory. At first
        views next to each other, which often see the same, go to the same worker.
        """
        workers = sorted(self.client.nthreads())
        submitted = {}
        cycle_name = "" if task == Task.FINISH else f"c{cycle:02}-"
        for number, view in enumerate(views):
            place = self.places.get(view)
            if place not in workers:
                place = workers[number * len(workers) // len(views)] if workers else None
            name = f"{task.name.lower()}-{cycle_name}v{view:04}"
            submitted[view] = self.submit(_do, name, (task, cycle, view), after(view), place)
        return submitted

    def submit(
        self,
        function: Callable[..., Any],
        name: str,
        arguments: tuple[int, ...],
        after: list[Future[Any]],
        place: str | None = None,
    ) -> Future[Any]:
        future: Future[Any] = self.client.submit(
            function,
            self.call,
            *arguments,
            after,
            key=f"skep-{name}-{self.call.name}",
            retries=self.retries,
            workers=None if place is None else [place],
            allow_other_workers=place is not None,
            pure=False,
        )
        self.futures.append(future)
        return future

    def close(self) -> None:
        """Stops what is under way on the workers, and unlocks the folder."""
        # A cluster that is gone has nothing to stop, and its own error is the one to raise.
        with contextlib.suppress(OSError, TimeoutError):
            self.client.cancel(self.futures)
            self.client.run(_close, self.call.folder, self.call.name)


class _Opened:
    """A run that a worker process has open."""

    def __init__(self, job: Job) -> None:
        self.job = job
        self.busy = threading.Lock()
        self.stopped = False

    def run_task(self, task: Task, cycle: int, view: int) -> None:
        # Memory is divided for the tasks of one call.
        with self.busy:
            if self.stopped:
                raise Cancelled("the run was stopped")
            progress = lambda _: CANCEL if self.stopped else None
            self.job.run_task(task, cycle=cycle, view=view, progress=progress)


_opened: dict[str, _Opened] = {}
"""The runs of a worker process by folder."""
_opening = threading.Lock()
_stopped: set[str] = set()
"""The names of calls that ended; Dask may still start tasks of theirs that it was about to start."""
_SECONDS_TO_STOP = 10.0
"""Time that a task has to notice that it is stopped; the next call may find the folder locked after it."""


def _open(call: _Call) -> _Opened:
    from distributed import get_worker

    with _opening:
        if call.name in _stopped:
            raise Cancelled("the run was stopped")
        if call.folder not in _opened:
            worker = get_worker()
            memory = call.memory
            if limit := worker.memory_manager.memory_limit:
                share = int(limit * _MEMORY_SHARE)
                memory = min(memory, share) if memory else share
            options = Options(threads=call.threads or worker.state.nthreads, memory=memory, simd=call.simd)
            job = Job.open(call.folder, options)
            if call.name in _stopped:
                job.close()
                raise Cancelled("the run was stopped")
            _opened[call.folder] = _Opened(job)
        return _opened[call.folder]


async def _close(folder: str, stopped: str | None = None) -> None:
    """Closes a run in this worker process; one that is at work only if its call is stopped."""
    if stopped is not None:
        _stopped.add(stopped)
    opened = _opened.get(folder)
    if opened is None or (stopped is None and opened.busy.locked()):
        return
    opened.stopped = True
    _opened.pop(folder, None)
    # A task under way needs the job until it has stopped.
    end = time.monotonic() + _SECONDS_TO_STOP
    while not opened.busy.acquire(blocking=False):
        if time.monotonic() > end:
            return
        await asyncio.sleep(0.02)
    # Not by itself: the traceback of a task that failed refers to the job for as long as Dask keeps it.
    opened.job.close()
    opened.busy.release()


def _do(call: _Call, task: Task, cycle: int, view: int, _after: object) -> str:
    """Does a task of a view; returns the worker's address."""
    from distributed import get_worker

    _open(call).run_task(task, cycle, view)
    return str(get_worker().address)


def _decide(call: _Call, cycle: int, _after: object) -> int | None:
    """Decides which cycle follows and returns it."""
    opened = _open(call)
    opened.run_task(Task.NEXT, cycle, 0)
    return _next_cycle(opened.job, cycle + 1)


def _fuse(call: _Call, _after: object) -> int:
    """Fuses the maps; returns the number of points."""
    _open(call).run_task(Task.FUSE, 0, 0)
    return _count_points(os.path.join(call.folder, "fused.ply"))


def _count_points(cloud: str) -> int:
    """The number of points in the header of a PLY file."""
    with open(cloud, "rb") as file:
        for line in file:
            words = line.split()
            if words[:2] == [b"element", b"vertex"]:
                return int(words[2])
            if words == [b"end_header"]:
                break
    raise FileError(f"{cloud}: the header has no number of points")
