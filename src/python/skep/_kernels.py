"""The method's kernels by themselves: stateless, for any number of threads."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._buffers import doubles, indices, pointer
from ._camera import Camera
from ._errors import ArgumentError, check
from ._images import Order, image as to_image
from ._native import ffi, lib
from ._objects import Immutable, NotPickled


def plane_through(camera: Camera, x: float, y: float, depth: float, normal: ArrayLike) -> NDArray[np.float64]:
    """The plane with this unit normal through the point of pixel (x, y), which may be fractional, at `depth`.

    A plane is four numbers in the camera's frame: a unit normal that faces the camera, and a distance, so
    that normal . X = -distance.
    """
    given = doubles(normal, (3,), "normal")
    plane = np.empty(4)
    out = ffi.cast("skep_plane *", pointer(plane))
    check(lib.skep_plane_through(camera.to_c(), x, y, depth, pointer(given), out))
    return plane


def plane_homographies(reference: Camera, source: Camera, planes: ArrayLike) -> NDArray[np.float64]:
    """H = K' (R - t n^T / D) K^-1 of planes (n, 4), so that (x', y', 1) ~ H (x, y, 1); (n, 3, 3)."""
    given = doubles(planes, (-1, 4), "planes")
    homographies = np.empty((len(given), 3, 3))
    structs = ffi.cast("skep_plane *", pointer(given))
    cameras = reference.to_c(), source.to_c()
    check(lib.skep_plane_homographies(*cameras, structs, len(given), pointer(homographies)))
    return homographies


class PackedImage(Immutable, NotPickled):
    """An image, copied into the layout the kernels sample. Never changes.

    The arguments are those of `Scene.add_view`.
    """

    __slots__ = ("_handle",)

    _handle: Any
    _instead = "send the image, and pack it there"

    def __init__(self, image: NDArray[Any], order: Order = "rgb", white: float | None = None) -> None:
        given = to_image(image, order, white)
        out = ffi.new("skep_packed_image **")
        check(lib.skep_packed_image_create(given.struct, out))
        self._handle = ffi.gc(out[0], lib.skep_packed_image_destroy)


class NccWindow(Immutable, NotPickled):
    """A square window of half side `radius`, sampled every `step` pixels. Never changes.

    A sample weighs exp(-r^2 / (2 sigma_spatial^2) - dI^2 / (2 sigma_color^2)), r pixels and dI of gray from
    the center; infinite sigmas, the default, give all samples the same weight. A patch whose weighted
    variance is below `min_variance` has no texture.
    """

    __slots__ = ("_handle",)

    _handle: Any
    _instead = "send its arguments, and make it there"

    def __init__(
        self,
        radius: int = 5,
        step: int = 2,
        sigma_spatial: float = math.inf,
        sigma_color: float = math.inf,
        min_variance: float = 1e-5,
    ) -> None:
        out = ffi.new("skep_ncc_window **")
        check(lib.skep_ncc_window_create(radius, step, sigma_spatial, sigma_color, min_variance, out))
        self._handle = ffi.gc(out[0], lib.skep_ncc_window_destroy)


def patch_ncc(
    window: NccWindow, reference: PackedImage, source: PackedImage, pixels: ArrayLike, homographies: ArrayLike
) -> NDArray[np.float32]:
    """Normalized cross-correlations of patches around `pixels` (n, 2) of the reference, x before y, with
    their images in the source by `homographies` (n, 3, 3): -1 to 1; -1 also where either side has no texture.
    """
    centers = indices(np.asarray(pixels), "pixels")
    maps = doubles(homographies, (-1, 3, 3), "homographies")
    if centers.shape != (len(maps), 2):
        raise ArgumentError(
            f"pixels has shape {centers.shape}: must be ({len(maps)}, 2), one for each homography"
        )
    ncc = np.empty(len(maps), dtype=np.float32)
    samples = reference._handle, source._handle
    check(
        lib.skep_patch_ncc(window._handle, *samples, pointer(centers), pointer(maps), len(maps), pointer(ncc))
    )
    return ncc
