"""Every number the method depends on."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Literal

import numpy as np

from ._buffers import take_text, text
from ._errors import check
from ._native import ffi, lib

Value = int | float | bool | str
"""The value of an option."""


def _names() -> Iterator[str]:
    position = 0
    while name := lib.skep_option_name(position):
        yield ffi.string(name).decode()
        position += 1


_NAMES = tuple(_names())


def _by_any_name() -> dict[str, str]:
    """The full name of an option by each name that stands for it."""
    fields = [name.rpartition(".")[2] for name in _NAMES]
    full = {field: name for field, name in zip(fields, _NAMES) if fields.count(field) == 1}
    full |= {name.replace(".", "_"): name for name in _NAMES}
    return full | {name: name for name in _NAMES}


_BY_ANY_NAME = _by_any_name()


class Options(Mapping[str, Value]):
    """Options by name, as items or attributes: `options["check.depth_tolerance"]` is `options.check_depth_tolerance`.

    Where no other group has an option of that name, the group may be left out: `options["threads"]`,
    `options.window_radius`. Values are checked when they are set.

    Starts from a preset: "default" is the most accurate, "fast" takes less than half of its time, "paper" follows the
    paper literally. `Options("fast", threads=2, fusion_min_views=2)` sets some at once.
    """

    __slots__ = ("_handle",)

    _handle: Any

    # BEGIN OPTIONS
    # END OPTIONS

    def __init__(self, preset: Literal["default", "fast", "paper"] = "default", **values: Value) -> None:
        out = ffi.new("skep_options **")
        check(lib.skep_options_create(text(preset, "preset"), out))
        object.__setattr__(self, "_handle", ffi.gc(out[0], lib.skep_options_destroy))
        for name, value in values.items():
            self[name] = value

    def __getitem__(self, name: str) -> Value:
        if name not in _BY_ANY_NAME:
            raise KeyError(name)
        full = _BY_ANY_NAME[name]
        value = take_text(lambda *out: lib.skep_options_get_text(self._handle, full.encode(), *out))
        return _TYPES[full](value)

    def __setitem__(self, name: str, value: Value) -> None:
        full = text(_BY_ANY_NAME.get(name, name), "name")
        if isinstance(value, bool | np.bool_):
            value = str(value).lower()
        # A text holds every whole number, and the shortest text of a float is read back to the bit.
        check(lib.skep_options_set_text(self._handle, full, text(str(value), name)))

    def __contains__(self, name: object) -> bool:
        return name in _BY_ANY_NAME

    def __iter__(self) -> Iterator[str]:
        return iter(_NAMES)

    def __len__(self) -> int:
        return len(_NAMES)

    def __getattr__(self, attribute: str) -> Value:
        if attribute not in _BY_ANY_NAME:
            raise AttributeError(f"there is no option {attribute!r}")
        return self[attribute]

    def __setattr__(self, attribute: str, value: Value) -> None:
        if attribute not in _BY_ANY_NAME:
            raise AttributeError(f"there is no option {attribute!r}")
        self[attribute] = value

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *(name for name in _BY_ANY_NAME if name.isidentifier())]

    def __repr__(self) -> str:
        return f"Options({dict(self)})"


def _switch(value: str) -> bool:
    return value == "true"


_TYPES = {
    name: {"int": int, "float": float, "bool": _switch, "str": str}[Options.__annotations__[name.replace(".", "_")]]
    for name in _NAMES
}


def handle(options: Options | None) -> Any:
    """The options as the library takes them; None is the default preset."""
    return ffi.NULL if options is None else options._handle
