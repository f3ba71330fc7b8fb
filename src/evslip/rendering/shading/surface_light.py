"""Light on a surface, of every body: what arrives from the lamp, and the one place where all light is summed."""

import math
from typing import Any

import numpy as np

from evslip.rendering.scratch import HALF, ONE, ZERO, f32, formula, kernel
from evslip.rendering.shading.ambient import irradiance
from evslip.rendering.slots import LIT, U, V


def received_light(
    around: Any, opened: np.ndarray, lit: np.ndarray, seen: np.ndarray, glossy: np.ndarray, mirrored: Any = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Light that points reflect as their albedo says, and what they mirror: their luminance is albedo x the former +
    the latter.

    around: light from all around, as luminance of white, of which the share `opened` arrives; lit: that of the lamp, of
    which no shadow takes the share `seen`; glossy: the lamp's highlight, in the same shadow; mirrored: the background.
    """
    return around * opened + lit * seen, glossy * seen + mirrored * opened


@formula
def risen(height):
    """Mean of max(0, height + y) over a unit disc in y, for height in [-1, 1]: the cosine of a lamp that is cut by the
    receiver's horizon, in units of its angular radius. Fit to the integral within 0.002; 0 at -1 and `height` at 1.
    """
    y = height * height
    return HALF * height + f32(0.2122066) + y * (f32(0.3255868) - y * f32(0.0377934))


@formula
def matt(power, near, cosine, lamp_radius):
    """Luminance of white matt paint under a lamp that is a sphere, cut by the receiver's horizon.

    power: luminance x radius^2 of the lamp; near: 1 / way to its centre; cosine: of the angle at which that stands.
    """
    size = lamp_radius * near
    rise = min(max(cosine / size, -ONE), ONE)
    return power * near * near * (size * risen(rise) + max(cosine - size, ZERO))


@formula
def highlight(shine):
    """The highlight's share, of the square of the cosine of the half-way vector (Blinn-Phong, exponent 32)."""
    shine *= shine
    shine *= shine
    shine *= shine
    shine *= shine
    return shine


@kernel
def light_plane(S, n, lamp, power, lamp_radius):
    """LIT, as of `matt`, at the points U, V of a plane.

    lamp (3,): its centre along u, v and the normal; power: luminance x radius^2.
    """
    lamp_u, lamp_v, lamp_n = lamp[0], lamp[1], lamp[2]
    for i in range(n):
        to_u, to_v = lamp_u - S[U + i], lamp_v - S[V + i]
        near = ONE / math.sqrt(to_u * to_u + to_v * to_v + lamp_n * lamp_n)
        S[LIT + i] = matt(power, near, lamp_n * near, lamp_radius)


@kernel
def light_points(places, normals, lamp, power, lamp_radius, ambient):
    """Light from all around and from the lamp, as luminance of white matt paint, and share of the lamp's highlight,
    where nothing stands between: float32 (n,) each.

    places, normals (3, n): in camera axes, normals of length 1; lamp (3,): its centre; power: luminance x radius^2;
    ambient: of `ambient.irradiance`, in camera axes.
    """
    count = places.shape[1]
    around, lit, shine = np.empty(count, np.float32), np.empty(count, np.float32), np.empty(count, np.float32)
    for i in range(count):
        x, y, z = places[0, i], places[1, i], places[2, i]
        n0, n1, n2 = normals[0, i], normals[1, i], normals[2, i]
        d0, d1, d2 = lamp[0] - x, lamp[1] - y, lamp[2] - z
        near, back = ONE / math.sqrt(d0 * d0 + d1 * d1 + d2 * d2), ONE / math.sqrt(x * x + y * y + z * z)
        lit[i] = matt(power, near, (n0 * d0 + n1 * d1 + n2 * d2) * near, lamp_radius)
        around[i] = irradiance(ambient, n0, n1, n2)
        h0, h1, h2 = d0 * near - x * back, d1 * near - y * back, d2 * near - z * back
        half_way = max(ZERO, n0 * h0 + n1 * h1 + n2 * h2)
        shine[i] = highlight(half_way * half_way / (h0 * h0 + h1 * h1 + h2 * h2 + f32(1e-9)))
    return around, lit, shine
