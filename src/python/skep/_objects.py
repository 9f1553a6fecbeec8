"""How objects of the library are copied and pickled."""

from __future__ import annotations

import copy
from typing import Any, ClassVar, NoReturn, TypeVar

from ._errors import ArgumentError

Self = TypeVar("Self", bound="Immutable")


class Immutable:
    """An object that never changes: a copy of it is the object itself."""

    __slots__ = ()

    def __copy__(self: Self) -> Self:
        return self

    def __deepcopy__(self: Self, _: Any) -> Self:
        return self


class NotPickled:
    """An object of the library that has no form as bytes; pickling it says what to send instead."""

    __slots__ = ()

    _instead: ClassVar[str]

    def __reduce__(self) -> NoReturn:
        raise TypeError(f"a skep.{type(self).__name__} cannot be pickled: {self._instead}")


Instance = TypeVar("Instance", bound="SentAsArrays")


class SentAsArrays:
    """An object of the library that never changes, and is pickled as the attributes that are read from it.
    What is unpickled has no object of the library.
    """

    _handle: Any
    _sent: ClassVar[tuple[str, ...]]
    """All that the others are made from."""

    def __getstate__(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in self._sent}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state, _handle=None)

    def __copy__(self: Instance) -> Instance:
        return self

    def __deepcopy__(self: Instance, memo: dict[int, Any]) -> Instance:
        copied = type(self).__new__(type(self))
        copied.__setstate__(copy.deepcopy(self.__getstate__(), memo))
        copied._handle = self._handle
        return copied

    def _held(self, what: str) -> Any:
        """The object of the library, for what needs more than the attributes."""
        if self._handle is None:
            name = f"skep.{type(self).__name__}"
            raise ArgumentError(f"a {name} that was unpickled cannot {what}: do it where it was made")
        return self._handle
