"""Distortion of the image by a lens: the model of Brown and Conrady, with OpenCV's names and signs."""

from typing import NamedTuple

import numpy as np

from evslip.utils.errors import PlanRejected

STEPS = 50
PRECISION = 1e-12
FOLD_CHECKS = 16
"""Places between the axis and a point at which the lens must not turn the image over."""


class Distortion(NamedTuple):
    """Radial and tangential distortion of image places x (right), y (down), in units of the focal length:

        x' = x (1 + k1 r^2 + k2 r^4) + 2 p1 x y + p2 (r^2 + 2 x^2)
        y' = y (1 + k1 r^2 + k2 r^4) + p1 (r^2 + 2 y^2) + 2 p2 x y

    Source: OpenCV's documentation of its module calib3d, there with more terms; D. C. Brown, Decentering distortion of
    lenses, Photogrammetric Engineering 32 (1966).
    """

    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0

    def distort(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Places where the lens shows what a pinhole shows at x and y, arrays of one shape."""
        k1, k2, p1, p2 = self
        square = x * x + y * y
        radial = 1 + square * (k1 + k2 * square)
        return (
            x * radial + 2 * p1 * x * y + p2 * (square + 2 * x * x),
            y * radial + p1 * (square + 2 * y * y) + 2 * p2 * x * y,
        )

    def jacobian(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Derivatives of `distort`, of shape (..., 2, 2)."""
        k1, k2, p1, p2 = self
        square = x * x + y * y
        radial, slope = 1 + square * (k1 + k2 * square), 2 * k1 + 4 * k2 * square
        across = slope * x * y + 2 * p1 * x + 2 * p2 * y
        first = radial + slope * x * x + 2 * p1 * y + 6 * p2 * x
        second = radial + slope * y * y + 6 * p1 * y + 2 * p2 * x
        return np.stack([np.stack([first, across], -1), np.stack([across, second], -1)], -2)

    def undistort(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Places that `distort` sends to x and y, by Newton's method. Raises PlanRejected where the image folds."""
        u, v = np.array(x, float), np.array(y, float)
        with np.errstate(all="ignore"):
            for _ in range(STEPS):
                du, dv = self.distort(u, v)
                du, dv = du - x, dv - y
                if np.abs(du).max(initial=0) < PRECISION and np.abs(dv).max(initial=0) < PRECISION:
                    break
                (a, b), (c, d) = np.moveaxis(self.jacobian(u, v), (-2, -1), (0, 1))
                determinant = a * d - b * c
                u, v = u - (d * du - b * dv) / determinant, v - (a * dv - c * du) / determinant
            found = self.distort(u, v)
            error = max(np.abs(found[0] - x).max(initial=0), np.abs(found[1] - y).max(initial=0))
            if not error < 100 * PRECISION or self._folds(u, v):
                raise PlanRejected(
                    "camera",
                    f"camera.k1 {self.k1:g}, k2 {self.k2:g}, p1 {self.p1:g}, p2 {self.p2:g}: this lens folds the image "
                    "over before its corners; expected smaller values or a smaller camera.fov_deg",
                )
        return u, v

    def _folds(self, u: np.ndarray, v: np.ndarray) -> bool:
        """Whether the lens turns the image over anywhere between the axis and these places."""
        for share in np.arange(1, FOLD_CHECKS + 1) / FOLD_CHECKS:
            jacobian = self.jacobian(share * u, share * v)
            determinant = jacobian[..., 0, 0] * jacobian[..., 1, 1] - jacobian[..., 0, 1] ** 2
            if not np.all((determinant > 0) & (jacobian[..., 0, 0] + jacobian[..., 1, 1] > 0)):
                return True
        return False


NO_DISTORTION = Distortion()
