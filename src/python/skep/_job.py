"""Runs in a folder: larger than memory, resumed, divided among processes and machines."""

from __future__ import annotations

import os
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from . import _options
from ._buffers import path
from ._errors import check
from ._native import ffi, lib
from ._objects import NotPickled
from ._options import Options
from ._run import ProgressFunction, run, run_plain


class Task(IntEnum):
    """What a task of a run does."""

    SEARCH = lib.SKEP_TASK_SEARCH
    """Search the planes of a view in a cycle."""
    CHECK = lib.SKEP_TASK_CHECK
    """Check the planes of a view in a cycle, after all views were searched."""
    NEXT = lib.SKEP_TASK_NEXT
    """Decide which cycle follows, after all views were checked."""
    FINISH = lib.SKEP_TASK_FINISH
    """Write the maps of a view, after the last cycle."""
    FUSE = lib.SKEP_TASK_FUSE
    """Fuse the maps, after all views are finished."""


@dataclass(frozen=True)
class JobNeeds:
    """What a run needs, estimated before it starts."""

    least_memory: int
    """The least memory in bytes with which the run works."""
    memory: int
    """The memory in bytes that the run keeps to."""
    disk: int
    """Bytes on disk, at most at any time."""
    cpu_seconds: float
    """CPU seconds of all threads together, within a factor of about two."""


class Job(NotPickled):
    """A run in a folder.

        job = skep.Job.plan("SCENE", "SCENE/dense", skep.Options("fast"))
        points = job.run(lambda progress: print(f"{progress.done:.0%}"))

    The same lines go on where a run was interrupted. `Job.open` opens a planned run for some of its tasks, in
    several processes at the same time.
    """

    _instead = "send its folder, and open it there with Job.open"

    def __init__(self, handle: Any) -> None:
        self._handle = handle

    def __repr__(self) -> str:
        if self._handle is None:
            return "<skep.Job, closed>"
        return f"<skep.Job of {self.view_count} views, {self.cycle_count} cycles at most>"

    @staticmethod
    def plan(
        scene: str | os.PathLike[str],
        folder: str | os.PathLike[str],
        options: Options | None = None,
        *,
        depth_range: tuple[float, float] = (0.0, 0.0),
        fresh: bool = False,
        progress: ProgressFunction | None = None,
    ) -> Job:
        """Plans the run of a COLMAP scene (images/ and sparse/) in a folder, which is created. A run of the
        same photographs, model, options and version that began there goes on, unless `fresh`; anything else
        begins anew, and `notices` tells why. `progress` is told of the photographs that are read.
        """
        near, far = depth_range
        chosen = _options.handle(options)
        names = path(scene, "scene"), path(folder, "folder")

        def call(callback: Any, user: Any, out: Any) -> int:
            wanted = (names[0], near, far, chosen, names[1], int(fresh))
            return int(lib.skep_job_plan(*wanted, callback, user, out))

        return Job(run(call, "skep_job", progress))

    @staticmethod
    def open(folder: str | os.PathLike[str], options: Options | None = None) -> Job:
        """Opens a run that was planned. Of the options only `threads`, `memory` and `simd` count: the others
        are those it was planned with.
        """
        out = ffi.new("skep_job **")
        chosen = _options.handle(options)
        check(lib.skep_job_open(path(folder, "folder"), chosen, out))
        return Job(ffi.gc(out[0], lib.skep_job_destroy))

    def close(self) -> None:
        """Unlocks the folder; what is done stays there. The job cannot be used any more."""
        if self._handle is not None:
            ffi.release(self._handle)
            self._handle = None

    def __enter__(self) -> Job:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def cycle_count(self) -> int:
        """Number of cycles on all scales."""
        return self._count(0)

    @property
    def view_count(self) -> int:
        """Number of views."""
        return self._count(1)

    def _count(self, which: int) -> int:
        out = ffi.new("uint32_t[2]")
        check(lib.skep_job_get_count(self._handle, out, out + 1))
        return int(out[which])

    @property
    def needs(self) -> JobNeeds:
        """What the run needs."""
        out = ffi.new("skep_job_needs *")
        check(lib.skep_job_get_needs(self._handle, out))
        return JobNeeds(out.least_memory, out.memory, out.disk, out.cpu_seconds)

    @property
    def notices(self) -> list[str]:
        """What became of an earlier run in the folder, and warnings about the scene."""
        found: list[str] = []
        needed = ffi.new("size_t *")
        while lib.skep_job_get_notice(self._handle, len(found), ffi.NULL, 0, needed) == lib.SKEP_OK:
            text = ffi.new("char[]", needed[0])
            check(lib.skep_job_get_notice(self._handle, len(found), text, needed[0], ffi.NULL))
            found.append(ffi.string(text).decode())
        return found

    def views_read(self, view: int) -> list[int]:
        """The views whose files the tasks of a view read."""
        count = ffi.new("size_t *")
        views = ffi.new("uint32_t[]", self.view_count)
        check(lib.skep_job_get_views_read(self._handle, view, views, len(views), count))
        return list(views[0 : count[0]])

    def run(self, progress: ProgressFunction | None = None) -> int:
        """Does all tasks that are not done; returns the number of points."""
        points = ffi.new("uint64_t *")
        run_plain(lambda callback, user: lib.skep_job_run(self._handle, callback, user, points), progress)
        return int(points[0])

    def run_task(
        self, task: Task, *, cycle: int = 0, view: int = 0, progress: ProgressFunction | None = None
    ) -> None:
        """Does a task; nothing if it is done or needless. The tasks it depends on must be done."""

        def call(callback: Any, user: Any) -> int:
            return int(lib.skep_job_run_task(self._handle, int(task), cycle, view, callback, user))

        run_plain(call, progress)

    def is_done(self, task: Task, *, cycle: int = 0, view: int = 0) -> bool:
        """Whether a task is done, or needless because a scale ended early."""
        out = ffi.new("int32_t *")
        check(lib.skep_job_is_done(self._handle, int(task), cycle, view, out))
        return bool(out[0])
