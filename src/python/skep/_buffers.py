"""Conversion of numpy arrays to C pointers, without a copy where the library can use the memory in place."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._errors import ArgumentError, check
from ._native import ffi

T = TypeVar("T")

_C_TYPES = {"u1": "uint8_t", "u2": "uint16_t", "u4": "uint32_t", "f4": "float", "f8": "double"}


class Rows(NamedTuple):
    """A map for the library. `array` owns the memory: keep it as long as the pointer is used."""

    pointer: Any
    stride: int
    array: NDArray[Any]


def pointer(array: NDArray[Any]) -> Any:
    """The address of an array's first element; it does not keep the array alive."""
    return ffi.cast(f"{_C_TYPES[array.dtype.str[1:]]} *", array.ctypes.data)


def rows(values: ArrayLike, dtype: Any, shape: tuple[int, ...], name: str) -> Rows:
    """A map of this type and shape: in place if its rows have no gaps within, else copied."""
    array = np.asarray(values)
    if array.shape != shape:
        raise ArgumentError(f"{name} has shape {array.shape}: must be {shape}")
    if not np.can_cast(array.dtype, dtype, casting="same_kind"):
        raise ArgumentError(f"{name} has type {array.dtype}: must be {np.dtype(dtype)}")
    array = array.astype(dtype, order="K", copy=False)
    inner = int(np.prod(shape[1:])) * array.itemsize
    stride = inner if shape[0] == 1 else array.strides[0]
    if not array[0].flags.c_contiguous or stride < inner or not array.dtype.isnative:
        array = np.ascontiguousarray(array)
        stride = inner
    return Rows(pointer(array), stride, array)


def doubles(values: ArrayLike, shape: tuple[int, ...], name: str) -> NDArray[np.float64]:
    """Contiguous doubles of this shape, in which -1 stands for any length."""
    try:
        array = np.ascontiguousarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ArgumentError(f"{name} is not an array of numbers: {error}") from None
    fits = array.ndim == len(shape) and all(want in (-1, have) for want, have in zip(shape, array.shape))
    if not fits:
        raise ArgumentError(f"{name} has shape {array.shape}: must be {str(shape).replace('-1', 'n')}")
    return array


def indices(values: Iterable[int] | NDArray[Any], name: str) -> NDArray[np.uint32]:
    """Contiguous view numbers, counts or pixels."""
    array = np.asarray(values if isinstance(values, np.ndarray) else list(values))
    if array.size == 0:
        return np.zeros(array.shape, dtype=np.uint32)
    if array.dtype.kind not in "iu" or array.min() < 0 or array.max() > 0xFFFFFFFF:
        raise ArgumentError(f"{name} must be whole numbers from 0")
    return np.ascontiguousarray(array, dtype=np.uint32)


def index(value: int, name: str) -> int:
    """A number for C; the library checks whether it is in range."""
    if not 0 <= value <= 0xFFFFFFFF:
        raise ArgumentError(f"{name} is {value}: must be a whole number from 0")
    return value


def text(value: str | bytes, name: str) -> bytes:
    """A text without NUL, which C would take as its end."""
    encoded = value.encode() if isinstance(value, str) else value
    if b"\0" in encoded:
        raise ArgumentError(f"{name} is {value!r}: must not contain NUL")
    return encoded


def path(value: str | bytes | os.PathLike[str] | os.PathLike[bytes], name: str) -> bytes:
    """A path in the bytes of the file system."""
    return text(os.fsencode(value), name)


def take_text(call: Callable[[Any, int, Any], int]) -> str:
    """The text that `call` copies into (buffer, capacity, needed_out)."""
    needed = ffi.new("size_t *")
    check(call(ffi.NULL, 0, needed))
    buffer = ffi.new("char[]", needed[0])
    check(call(buffer, needed[0], needed))
    return bytes(ffi.string(buffer)).decode()


def take_indices(call: Callable[[Any, int, Any], int]) -> tuple[int, ...]:
    """The list of numbers that `call` copies into (list, capacity, count_out)."""
    count = ffi.new("size_t *")
    check(call(ffi.NULL, 0, count))
    found = ffi.new("uint32_t[]", count[0])
    check(call(found, count[0], count))
    return tuple(found)


def until_refused(item: Callable[[int], T]) -> Iterator[T]:
    """The items with the numbers 0, 1, ..., as many as there are."""
    for number in itertools.count():
        try:
            yield item(number)
        except ArgumentError:
            return


class _Borrowed:
    """Memory of a library object, which numpy keeps alive through this as long as an array uses it."""

    def __init__(self, owner: Any, address: Any, dtype: Any, shape: tuple[int, ...]) -> None:
        self.owner = owner
        self.__array_interface__ = {
            "version": 3,
            "data": (int(ffi.cast("uintptr_t", address)), True),
            "typestr": np.dtype(dtype).str,
            "shape": shape,
        }


def borrow(owner: Any, address: Any, dtype: Any, shape: tuple[int, ...]) -> NDArray[Any]:
    """A read-only array of memory inside `owner`, which lives as long as the array."""
    return np.asarray(_Borrowed(owner, address, dtype, shape))
