"""Maps in COLMAP's layouts."""

from __future__ import annotations

import os
from typing import Any, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._buffers import indices, path, pointer, rows
from ._errors import ArgumentError, check
from ._native import ffi, lib

Path = Union[str, "os.PathLike[str]"]


def _write(function: Any, file: Path, values: ArrayLike, channels: tuple[int, ...], name: str) -> None:
    shape = np.shape(values)
    if shape[2:] != channels or len(shape) < 2 or 0 in shape:
        raise ArgumentError(f"{name} has shape {shape}: must be {('height', 'width', *channels)}")
    given = rows(values, np.float32, shape, name)
    check(function(path(file, "file"), given.pointer, shape[1], shape[0], given.stride))


def _read(function: Any, file: Path, channels: tuple[int, ...]) -> NDArray[np.float32]:
    width, height = ffi.new("uint32_t *"), ffi.new("uint32_t *")
    name = path(file, "file")
    check(function(name, ffi.NULL, 0, width, height))
    values = np.empty((height[0], width[0], *channels), dtype=np.float32)
    check(function(name, pointer(values), values.size, width, height))
    return values


def write_depth_map(file: Path, depth: ArrayLike) -> None:
    """Writes a depth map, (height, width)."""
    _write(lib.skep_write_depth_map, file, depth, (), "depth")


def read_depth_map(file: Path) -> NDArray[np.float32]:
    """Reads a depth map, (height, width)."""
    return _read(lib.skep_read_depth_map, file, ())


def write_normal_map(file: Path, normal: ArrayLike) -> None:
    """Writes a normal map, (height, width, 3)."""
    _write(lib.skep_write_normal_map, file, normal, (3,), "normal")


def read_normal_map(file: Path) -> NDArray[np.float32]:
    """Reads a normal map, (height, width, 3)."""
    return _read(lib.skep_read_normal_map, file, (3,))


def write_consistency_graph(file: Path, counts: NDArray[Any], views: NDArray[Any]) -> None:
    """Writes a consistency graph: how many views each pixel has, (height, width), and which, pixel after
    pixel.
    """
    numbers, flat = indices(counts, "counts"), indices(views, "views")
    if numbers.ndim != 2:
        raise ArgumentError(f"counts has shape {numbers.shape}: must be (height, width)")
    height, width = numbers.shape
    name = path(file, "file")
    check(lib.skep_write_consistency_graph(name, width, height, pointer(numbers), pointer(flat), flat.size))


def read_consistency_graph(file: Path) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
    """Reads a consistency graph: how many views each pixel has, (height, width), and which, pixel after
    pixel.
    """
    width, height, total = ffi.new("uint32_t *"), ffi.new("uint32_t *"), ffi.new("size_t *")
    name, out = path(file, "file"), (width, height, total)
    check(lib.skep_read_consistency_graph(name, ffi.NULL, 0, ffi.NULL, 0, *out))
    counts = np.empty((height[0], width[0]), dtype=np.uint32)
    views = np.empty(total[0], dtype=np.uint32)
    check(
        lib.skep_read_consistency_graph(name, pointer(counts), counts.size, pointer(views), views.size, *out)
    )
    return counts, views
