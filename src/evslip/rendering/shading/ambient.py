"""Light from all around: what a surface of any direction receives from the background and the table."""

from typing import NamedTuple

import numpy as np

from evslip.rendering.scratch import formula

AZIMUTHS, ELEVATIONS, FINER = 64, 32, 8
"""Directions that the sky's light is taken from, each the mean of FINER x FINER: tiles repeat, and one direction each
could meet the same spot of all of them."""
NORMALS, FINE = 400, 10000
"""Directions that the light is fitted for, and those that it is checked for."""
LEAST = 2e-4
"""Share of the most light from any side that may be missed between FINE directions."""


class Ambient(NamedTuple):
    surface: float
    """Luminance of a white surface that faces upwards, under the sky alone, in cd/m2."""
    matrix: np.ndarray
    """Symmetric (4, 4) M: (n, 1) M (n, 1)^T is the luminance of a white matt surface with normal n in the open."""
    heights: np.ndarray
    """Mean luminance of the sky around each height, at equal steps of its sine, of shape (ELEVATIONS,)."""


def surround(sky: np.ndarray, luminance: float, repetitions: int, lamp: float, albedo: float) -> Ambient:
    """The ambient light of a scene.

    sky: coarse texture of the background (rows, columns), repeated `repetitions` times around the horizon, which a
    panorama (wider than high) has in the middle; luminance: of its white. The lower hemisphere is the table: it sends
    back `albedo` of what it receives from the sky and from the lamp (`lamp`: luminance the lamp gives to white paper on
    it), so that undersides are not black. Irradiance from a distant surround is, to 1 %, a quadratic form in the normal
    (Ramamoorthi and Hanrahan 2001); it is fitted here.
    """
    azimuth, height, upper = _dome(sky, luminance, repetitions)
    radius = np.sqrt(1 - height * height)[:, None]
    directions = np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), height[:, None] + 0 * azimuth], -1)
    share = 2.0 / (AZIMUTHS * ELEVATIONS)  # solid angle over pi
    surface = float(np.sum(upper * height[:, None]) * share)
    below = albedo * (surface + lamp)
    all_directions = np.concatenate([directions.reshape(-1, 3), directions.reshape(-1, 3) * (1, 1, -1)])
    radiance = np.concatenate([upper.ravel(), np.full(upper.size, below)])
    normals = spread(NORMALS)
    received = np.maximum(normals @ all_directions.T, 0.0) @ radiance * share
    a = np.linalg.lstsq(_basis(normals), received, rcond=None)[0]
    # Where next to nothing arrives, the fit may fall below zero; there is no such light.
    lift = max(0.0, LEAST * float(received.max()) - float((_basis(spread(FINE)) @ a).min()))
    matrix = np.array(
        [[a[0], a[3], a[4], a[6]], [a[3], a[1], a[5], a[7]], [a[4], a[5], a[2], a[8]], [a[6], a[7], a[8], lift]]
    )
    return Ambient(surface, matrix, upper.mean(1))


def _dome(sky: np.ndarray, luminance: float, repetitions: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The sky as `surround` takes it: azimuths (AZIMUTHS,), sines of heights (ELEVATIONS,), and the luminance there,
    (ELEVATIONS, AZIMUTHS)."""
    azimuth, height = _steps(AZIMUTHS) * 2 * np.pi, _steps(ELEVATIONS)
    aspect = sky.shape[1] / sky.shape[0]
    turns, sines = _steps(AZIMUTHS * FINER), _steps(ELEVATIONS * FINER)
    down = (0.5 if aspect > 1 else 0.0) - np.arcsin(sines) / (2 * np.pi) * repetitions * aspect
    rows = np.floor(down * sky.shape[0]).astype(int) % sky.shape[0]
    columns = np.floor(turns * repetitions * sky.shape[1]).astype(int) % sky.shape[1]
    found = sky[rows[:, None], columns[None, :]].astype(np.float64)
    return azimuth, height, luminance * found.reshape(ELEVATIONS, FINER, AZIMUTHS, FINER).mean((1, 3))


def _steps(count: int) -> np.ndarray:
    return (np.arange(count) + 0.5) / count


def spread(count: int) -> np.ndarray:
    """Directions spread evenly over the sphere, of shape (count, 3)."""
    z = 1 - 2 * (np.arange(count) + 0.5) / count
    turn = np.arange(count) * np.pi * (3 - np.sqrt(5))
    return np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], 1)


def _basis(normals: np.ndarray) -> np.ndarray:
    x, y, z = normals.T
    return np.stack([x * x, y * y, z * z, 2 * x * y, 2 * x * z, 2 * y * z, 2 * x, 2 * y, 2 * z], 1)


@formula
def irradiance(matrix, x, y, z):
    """The quadratic form of `Ambient.matrix` for a normal; of the type of its arguments."""
    squares = matrix[0, 0] * x * x + matrix[1, 1] * y * y + matrix[2, 2] * z * z
    mixed = matrix[0, 1] * x * y + matrix[0, 2] * x * z + matrix[1, 2] * y * z
    linear = matrix[0, 3] * x + matrix[1, 3] * y + matrix[2, 3] * z
    return squares + (mixed + linear) + (mixed + linear) + matrix[3, 3]  # a factor 2 would widen float32 to float64
