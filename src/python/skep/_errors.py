"""Failures as exceptions. Their texts are the library's: the argument, its value, and what would have been
right.
"""

from __future__ import annotations

from ._native import ffi, lib


class Error(Exception):
    """Base of all errors that calls of the library raise; `status` is the C ABI's code."""

    status: int = 0


class ArgumentError(Error, ValueError):
    """A value cannot be used: out of range, not finite, of the wrong size, unknown, or in the wrong order."""

    status = lib.SKEP_ERR_ARGUMENT


class PoisonedError(Error, RuntimeError):
    """The object cannot be used any more: a call that was changing it failed inside the library."""

    status = lib.SKEP_ERR_POISONED


class Cancelled(Error):
    """The progress callback cancelled the call."""

    status = lib.SKEP_ERR_CANCELLED


class FileError(Error, OSError):
    """A file cannot be read, parsed or written."""

    status = lib.SKEP_ERR_FILE


class CapacityError(Error):
    """A buffer is too small for its contents."""

    status = lib.SKEP_ERR_CAPACITY


class NotEnoughMemoryError(Error, MemoryError):
    """There is not enough memory for the call."""

    status = lib.SKEP_ERR_MEMORY


class InternalError(Error, RuntimeError):
    """An error of the library itself; please report the text."""

    status = lib.SKEP_ERR_PANIC


_KINDS = (
    ArgumentError,
    PoisonedError,
    Cancelled,
    FileError,
    CapacityError,
    NotEnoughMemoryError,
    InternalError,
)
_BY_STATUS: dict[int, type[Error]] = {kind.status: kind for kind in _KINDS}


def check(status: int) -> None:
    """Raises the error of a call that this thread made, unless it succeeded."""
    if status == lib.SKEP_OK:
        return
    size = lib.skep_last_error(ffi.NULL, 0)
    text = ffi.new("char[]", size)
    lib.skep_last_error(text, size)
    raise _BY_STATUS.get(status, InternalError)(ffi.string(text).decode())
