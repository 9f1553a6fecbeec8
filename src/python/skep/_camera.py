"""Pinhole cameras."""

from __future__ import annotations

from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._buffers import doubles
from ._errors import ArgumentError
from ._native import ffi
from ._objects import Immutable


class Camera(Immutable):
    """A pinhole camera without distortion: x_cam = R x_world + t, with x right, y down, z forward.

    `K` is [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], for pixels whose top-left center is (0, 0), as in OpenCV;
    COLMAP's principal points are half a pixel larger. Never changes; cameras of the same numbers are equal.
    """

    __slots__ = ("K", "R", "t")

    K: NDArray[np.float64]
    R: NDArray[np.float64]
    t: NDArray[np.float64]

    def __init__(self, K: ArrayLike, R: ArrayLike | None = None, t: ArrayLike | None = None) -> None:
        rotation = np.eye(3) if R is None else R
        translation = np.zeros(3) if t is None else np.ravel(np.asarray(t))
        object.__setattr__(self, "K", doubles(K, (3, 3), "K").copy())
        object.__setattr__(self, "R", doubles(rotation, (3, 3), "R").copy())
        object.__setattr__(self, "t", doubles(translation, (3,), "t").copy())
        if (
            self.K[0, 1] != 0
            or not np.array_equal(self.K[1:, 0], [0, 0])
            or not np.array_equal(self.K[2], [0, 0, 1])
        ):
            raise ArgumentError(f"K is {self.K.tolist()}: must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]")
        for matrix in (self.K, self.R, self.t):
            matrix.flags.writeable = False

    @property
    def center(self) -> NDArray[np.float64]:
        """The center of projection in the world frame."""
        center: NDArray[np.float64] = -self.R.T @ self.t
        return center

    def __setattr__(self, name: str, _: object) -> NoReturn:
        raise AttributeError(f"{name} of a camera cannot be changed: make another camera")

    def __eq__(self, other: object) -> bool:
        return self._numbers() == other._numbers() if isinstance(other, Camera) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._numbers())

    def _numbers(self) -> tuple[float, ...]:
        return (*self.K.flat, *self.R.flat, *self.t)

    def __reduce__(self) -> tuple[type[Camera], tuple[NDArray[np.float64], ...]]:
        return Camera, (self.K, self.R, self.t)

    def __repr__(self) -> str:
        return f"Camera(K={self.K.tolist()}, R={self.R.tolist()}, t={self.t.tolist()})"

    def to_c(self) -> Any:
        """For the library, which checks the numbers."""
        (fx, _, cx), (_, fy, cy), _ = self.K.tolist()
        camera = {"fx": fx, "fy": fy, "cx": cx, "cy": cy}
        return ffi.new(
            "skep_camera *", camera | {"rotation": self.R.ravel().tolist(), "translation": self.t.tolist()}
        )

    @staticmethod
    def from_c(camera: Any) -> Camera:
        """A copy of a camera of the library."""
        K = [[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]]
        return Camera(K, np.reshape(list(camera.rotation), (3, 3)), list(camera.translation))
