"""Photographs in numpy arrays."""

from __future__ import annotations

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


class Image(NamedTuple):
    """An image for the library. `array` owns the pixels: keep it as long as the struct is used."""

    struct: Any
    array: NDArray[Any]


def image(pixels: NDArray[Any], order: Order) -> Image:
    """Pixels of shape (height, width) or (height, width, 1, 3 or 4); uint8, uint16, or float32 from 0 to 1.

    They are read where they are when each row is without gaps, whatever lies between rows; else they are
    copied.
    """
    array = np.asarray(pixels)
    layout = None
    if array.ndim in (2, 3) and array.size:
        layout = _LAYOUTS.get((array.shape[2] if array.ndim == 3 else 1, order))
    if layout is None:
        wanted = '(height, width) or (height, width, 1, 3 or 4) with order "rgb" or "bgr"'
        raise ArgumentError(f"image has shape {array.shape} and order {order!r}: must be {wanted}")
    depth = _DEPTHS.get(array.dtype.str[1:])
    if depth is None:
        raise ArgumentError(f"image has type {array.dtype}: must be uint8, uint16 or float32")
    height, width = array.shape[:2]
    row = array[0].nbytes
    stride = row if height == 1 else array.strides[0]
    if not array[0].flags.c_contiguous or stride < row or not array.dtype.isnative:
        array = np.ascontiguousarray(array, dtype=array.dtype.newbyteorder("="))
        stride = row
    fields = {"data": ffi.cast("void *", array.ctypes.data), "width": width, "height": height}
    return Image(ffi.new("skep_image *", fields | {"stride_bytes": stride, "format": layout + depth}), array)
