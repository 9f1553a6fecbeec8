"""Every number the method depends on."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Literal, NamedTuple

from ._buffers import text
from ._errors import ArgumentError, check
from ._native import ffi, lib


class Scale(NamedTuple):
    """The search on one scale of the image pyramid."""

    halvings: int
    """How often the images are halved: 0 is full size."""
    foods: int
    """Food sources of each pixel's colony, 2 to 64."""
    first_iterations: int
    """Iterations of the first cycle on this scale."""
    cycles: int
    """Cycles after the first."""
    cycle_iterations: int
    """Iterations of each of those."""


def _names() -> Iterator[str]:
    position = 0
    while name := lib.skep_option_name(position):
        yield ffi.string(name).decode()
        position += 1


_NAMES = tuple(_names())
_ATTRIBUTES = {name.replace(".", "_"): name for name in _NAMES}


class Options(Mapping[str, float]):
    """Options by name, as items or attributes: `options["fusion.min_views"]` is `options.fusion_min_views`.

    Starts from a preset: "default", which measures best, "fast", which takes less than half of its time, or "paper",
    which follows the paper to the letter. `Options(threads=2, fusion_min_views=2)` sets some at once. Numbers are checked when they are set.
    """

    __slots__ = ("_handle",)

    _handle: Any

    def __init__(
        self,
        preset: Literal["default", "fast", "paper"] = "default",
        *,
        seed: int = 0,
        scales: Iterable[Scale | tuple[int, int, int, int, int]] | None = None,
        **values: float,
    ) -> None:
        out = ffi.new("skep_options **")
        check(lib.skep_options_create(text(preset, "preset"), out))
        object.__setattr__(self, "_handle", ffi.gc(out[0], lib.skep_options_destroy))
        self.seed = seed
        if scales is not None:
            self.scales = tuple(Scale(*scale) for scale in scales)
        for name, value in values.items():
            self[_ATTRIBUTES.get(name, name)] = value

    def __getitem__(self, name: str) -> float:
        if name not in _NAMES:
            raise KeyError(name)
        value = ffi.new("double *")
        check(lib.skep_options_get(self._handle, name.encode(), value))
        number: float = value[0]
        return number

    def __setitem__(self, name: str, value: float) -> None:
        check(lib.skep_options_set(self._handle, text(name, "name"), value))

    def __iter__(self) -> Iterator[str]:
        return iter(_NAMES)

    def __len__(self) -> int:
        return len(_NAMES)

    def __getattr__(self, attribute: str) -> float:
        if attribute not in _ATTRIBUTES:
            raise AttributeError(f"there is no option {attribute!r}")
        return self[_ATTRIBUTES[attribute]]

    def __setattr__(self, attribute: str, value: Any) -> None:
        if attribute in _ATTRIBUTES:
            self[_ATTRIBUTES[attribute]] = value
        elif hasattr(type(self), attribute):
            object.__setattr__(self, attribute, value)
        else:
            raise AttributeError(f"there is no option {attribute!r}")

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *_ATTRIBUTES]

    def __repr__(self) -> str:
        return f"Options({dict(self)}, seed={self.seed}, scales={list(self.scales)})"

    @property
    def seed(self) -> int:
        """Of the random generator. The same seed, input and library version give the same bits."""
        seed = ffi.new("uint64_t *")
        check(lib.skep_options_get_seed(self._handle, seed))
        return int(seed[0])

    @seed.setter
    def seed(self, seed: int) -> None:
        if not 0 <= seed < 1 << 64:
            raise ArgumentError(f"seed is {seed}: must be a whole number from 0 to 2^64 - 1")
        check(lib.skep_options_set_seed(self._handle, seed))

    @property
    def scales(self) -> tuple[Scale, ...]:
        """From coarse to fine: halvings descend one by one to 0."""
        count = ffi.new("size_t *")
        check(lib.skep_options_get_scales(self._handle, ffi.NULL, 0, count))
        found = ffi.new("skep_scale[]", count[0])
        check(lib.skep_options_get_scales(self._handle, found, count[0], count))
        return tuple(Scale(*(getattr(scale, field) for field in Scale._fields)) for scale in found)

    @scales.setter
    def scales(self, scales: Iterable[Scale | tuple[int, int, int, int, int]]) -> None:
        wanted = [Scale(*scale) for scale in scales]
        given = ffi.new("skep_scale[]", [scale._asdict() for scale in wanted])
        check(lib.skep_options_set_scales(self._handle, given, len(wanted)))

    def set_simd(self, level: Literal["scalar", "base", "v3"] | None) -> None:
        """The instruction set; None is the best the machine has. Results do not depend on it."""
        check(lib.skep_options_set_simd(self._handle, ffi.NULL if level is None else text(level, "level")))


def handle(options: Options | None) -> Any:
    """For the library; None are the defaults."""
    return ffi.NULL if options is None else options._handle
