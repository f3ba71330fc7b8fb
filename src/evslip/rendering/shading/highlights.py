"""Reflections of lamp and surroundings in a body of plastic, film or metal.

The lobe is that of `environment_reflection`: microfacets of Trowbridge and Reitz (GGX) with Schlick's reflectance. The
surroundings are those of the ambient light, blurred as matt paint blurs them: a quadratic form in the direction.
"""

import math

import numpy as np

from evslip.rendering.materials.paint import Finish
from evslip.rendering.scratch import HALF, ONE, ZERO, f32, kernel
from evslip.rendering.shading.ambient import irradiance
from evslip.rendering.shading.environment_reflection import slant

QUARTER, LEAST = f32(0.25), f32(1e-6)


def finished_light(
    finish: Finish, received: np.ndarray, lamp: np.ndarray, opened: np.ndarray, mirrors: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Light that a body reflects as its albedo says, and what it adds to that, as of `surface_light.received_light`,
    from what a matt one receives.

    lamp: the lamp's part of that; opened: share of the surroundings that reaches each point; mirrors: of
    `mirror_points`.
    """
    lobe, lamp_edge, around, around_edge = mirrors
    lamp, around = lobe * lamp, around * opened
    # Reflectance F + (1 - F) edge, where F is the clear layer's, and of the bare metal the albedo.
    edge = lamp_edge * lamp + around_edge * around
    straight = (lamp + around) - edge
    metal, clear = np.float32(finish.metallic), np.float32((1 - finish.metallic) * finish.reflectance)
    return (ONE - metal) * received + metal * straight, clear * straight + edge


@kernel
def mirror_points(places, normals, lamp, lamp_radius, ambient, roughness):
    """Light that points would mirror with a reflectance of 1: float32 (4, n).

    Rows: highlight, in units of the lamp's light on white matt paint; Schlick's share of it, 0 straight from above and
    1 at grazing angles; luminance of the surroundings; and Schlick's share of that. Arguments as of
    `surface_light.light_points`. A lamp of angular radius s is a point that makes the facets' width a of roughness^2
    (a^2 + s^2 / 4)^(1/2): at the highlight's middle that is the mean of the lobe over the lamp's disc.
    """
    found = np.empty((4, places.shape[1]), np.float32)
    square = roughness * roughness * roughness * roughness
    for i in range(places.shape[1]):
        x, y, z = places[0, i], places[1, i], places[2, i]
        n0, n1, n2 = normals[0, i], normals[1, i], normals[2, i]
        d0, d1, d2 = lamp[0] - x, lamp[1] - y, lamp[2] - z
        near, back = ONE / math.sqrt(d0 * d0 + d1 * d1 + d2 * d2), ONE / math.sqrt(x * x + y * y + z * z)
        v0, v1, v2 = -x * back, -y * back, -z * back
        h0, h1, h2 = d0 * near + v0, d1 * near + v1, d2 * near + v2
        length = h0 * h0 + h1 * h1 + h2 * h2 + LEAST
        light, view = (n0 * d0 + n1 * d1 + n2 * d2) * near, n0 * v0 + n1 * v1 + n2 * v2
        upright, size = max(ZERO, light + view), lamp_radius * near
        wide = square + QUARTER * size * size
        spread = upright * upright / length * (wide - ONE) + ONE
        open_both = slant(max(light, ZERO), wide) * slant(max(view, ZERO), wide)
        found[0, i] = wide / (spread * spread * open_both)
        grazing = max(ONE - HALF * math.sqrt(length), ZERO)
        found[1, i] = grazing * grazing * grazing * grazing * grazing
        twice, slanted = view + view, ONE - max(view, ZERO)
        found[2, i] = irradiance(ambient, twice * n0 - v0, twice * n1 - v1, twice * n2 - v2)
        found[3, i] = (ONE - roughness) * slanted * slanted * slanted * slanted * slanted
    return found
