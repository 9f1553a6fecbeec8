"""Photographs in numpy arrays."""

from __future__ import annotations

import warnings
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._errors import ArgumentError
from ._native import ffi, lib

Order = Literal["rgb", "bgr"]
"""The order of an image's channels: that of matplotlib, Pillow and imageio, or that of OpenCV."""

_LAYOUTS = {
    (1, "rgb"): lib.SKEP_FORMAT_GRAY,
    (1, "bgr"): lib.SKEP_FORMAT_GRAY,
    (3, "rgb"): lib.SKEP_FORMAT_RGB,
    (3, "bgr"): lib.SKEP_FORMAT_BGR,
    (4, "rgb"): lib.SKEP_FORMAT_RGBA,
    (4, "bgr"): lib.SKEP_FORMAT_BGRA,
}
_DEPTHS = {"u1": 0, "u2": lib.SKEP_FORMAT_16, "f4": lib.SKEP_FORMAT_FLOAT}
_WHITES = {"u1": 255.0, "u2": 65535.0, "f4": 1.0}
"""The value of white of each type, unless the caller says otherwise."""
_TOLERANCE = 1 / 255
"""How far values may lie outside 0 to white, as a fraction of it, in which they are clamped."""


class Image(NamedTuple):
    """An image for the library. `array` owns the pixels: keep it as long as the struct is used."""

    struct: Any
    array: NDArray[Any]


def image(pixels: NDArray[Any], order: Order, white: float | None = None, stacklevel: int = 3) -> Image:
    """Pixels of shape (height, width) or (height, width, 1, 3 or 4); uint8, uint16 or float32.

    `white` is the value of white; None is 255, 65535 or 1 by type. With that of the type, pixels are read
    where they are when each row is without gaps, whatever lies between rows; else they are copied.
    `stacklevel` is that of the user's code in warnings, as seen from here.
    """
    array = np.asarray(pixels)
    layout = None
    if array.ndim in (2, 3) and array.size:
        layout = _LAYOUTS.get((array.shape[2] if array.ndim == 3 else 1, order))
    if layout is None:
        wanted = '(height, width) or (height, width, 1, 3 or 4) with order "rgb" or "bgr"'
        raise ArgumentError(f"image has shape {array.shape} and order {order!r}: must be {wanted}")
    kind = array.dtype.str[1:]
    if kind not in _DEPTHS:
        raise ArgumentError(f"image has type {array.dtype}: must be uint8, uint16 or float32")
    if white is not None and not (np.isfinite(white) and white > 0):
        raise ArgumentError(f"white is {white}: must be a finite number above 0")
    _check_range(array, kind, white, stacklevel + 1)
    if white is not None and white != _WHITES[kind]:
        array, kind = _to_bytes(array, white), "u1"
    height, width = array.shape[:2]
    row = array[0].nbytes
    stride = row if height == 1 else array.strides[0]
    if not array[0].flags.c_contiguous or stride < row or not array.dtype.isnative:
        array = np.ascontiguousarray(array, dtype=array.dtype.newbyteorder("="))
        stride = row
    fields = {"data": ffi.cast("void *", array.ctypes.data), "width": width, "height": height}
    shape = {"stride_bytes": stride, "format": layout + _DEPTHS[kind]}
    return Image(ffi.new("skep_image *", fields | shape), array)


def _check_range(array: NDArray[Any], kind: str, white: float | None, stacklevel: int) -> None:
    """Refuses values outside 0 to white, and warns of 16 bits that look like fewer."""
    # The fourth channel is ignored.
    seen = array[..., :3] if array.ndim == 3 else array
    limit = _WHITES[kind] if white is None else white
    largest, name = seen.max().item(), f"value of the {array.dtype.name} image"
    if np.isnan(largest):
        row, column = np.argwhere(np.isnan(seen))[0][:2]
        raise ArgumentError(f"the {name} at column {column}, row {row} is not a number: must be one")
    if largest > limit * (1 + _TOLERANCE):
        guess = 255 if kind == "f4" and largest < 256 else f"{largest:g}"
        remedy = f"pass the value of white, such as white={guess}, or clip what interpolation left outside"
        raise ArgumentError(f"the largest {name} is {largest:g}: must be at most {limit:g}; {remedy}")
    if kind == "f4" and (smallest := seen.min().item()) < -limit * _TOLERANCE:
        remedy = "add the mean that was subtracted, or clip what interpolation left outside"
        raise ArgumentError(f"the smallest {name} is {smallest:g}: must be at least 0; {remedy}")
    if kind == "u2" and white is None and 0 < largest <= 65535 // 16:
        bits = next(bits for bits in (8, 10, 12) if largest < 1 << bits)
        remedy = f"pass white={(1 << bits) - 1} if it has {bits} bits, white=65535 if it is that dark"
        warnings.warn(f"the largest {name} is {largest}, nearly black: {remedy}", stacklevel=stacklevel)


def _to_bytes(array: NDArray[Any], white: float) -> NDArray[np.uint8]:
    """Pixels of 8 bits, to which the library rounds those of other types."""
    scaled = np.empty(array.shape, dtype=np.uint8)
    # Row by row, as a whole photograph in doubles takes much memory. What is ignored may be NaN.
    for row, values in zip(scaled, array):
        levels = np.nan_to_num(values.astype(np.float64)) * (255 / white)
        row[...] = np.floor(np.clip(levels, 0, 255) + 0.5)
    return scaled
