"""Mirrored background and lamp of a glossy table: little from above, much at the low angle of a hand's camera.

The lobe is that of rough plastic: microfacets as of Trowbridge and Reitz (GGX; B. Walter et al., EGSR 2007) with
Schlick's reflectance, as the path tracer has it. The background counts with its mean around each height.
"""

import math

import numpy as np

from evslip.rendering.scratch import ONE, ZERO, f32, formula, kernel
from evslip.rendering.slots import GLOSS, LIT, RAY_X, RAY_Y, RESULT, U, V

TERMS = 8
"""Terms of the polynomial in 1 - cosine."""
COSINES = np.linspace(0.01, 1.0, 100)
"""Cosines of the view's angle to the normal at which the polynomial is fitted."""
AROUND = 128
"""Azimuths between view and light."""


def fit_reflection(sky: np.ndarray, roughness: float, reflectance: float) -> np.ndarray:
    """Polynomial, float32 of shape (TERMS,), in 1 - cosine of the angle to the normal: the luminance that a surface
    which faces upwards mirrors, in cd/m2.

    sky: mean luminance at equal steps of the height's sine above the horizon, (n,); roughness: width of the lobe, its
    alpha; reflectance: straight from above.
    """
    height = ((np.arange(len(sky)) + 0.5) / len(sky))[None, :, None]
    across = np.cos((np.arange(AROUND) + 0.5) / AROUND * np.pi)[None, None, :]
    view = COSINES[:, None, None]
    level = np.sqrt((1 - height**2) * (1 - view**2)) * across
    half = np.sqrt(2 + 2 * (height * view + level))  # length of the sum of both unit vectors
    upright, facing = (height + view) / half, half / 2
    lobe = roughness**2 / (np.pi * (upright**2 * (roughness**2 - 1) + 1) ** 2)
    seen = _unshadowed(height, roughness) * _unshadowed(view, roughness)
    fresnel = reflectance + (1 - reflectance) * (1 - facing) ** 5
    per_step = 2 * np.pi / (len(sky) * AROUND)
    mirrored = np.sum(lobe * seen * fresnel / (4 * view) * sky[None, :, None], (1, 2)) * per_step
    powers = (1 - COSINES)[:, None] ** np.arange(TERMS)
    return np.linalg.lstsq(powers, mirrored, rcond=None)[0].astype(np.float32)


def _unshadowed(cosine: np.ndarray, roughness: float) -> np.ndarray:
    """Share of the microfacets that others leave visible (Smith)."""
    return 2 * cosine / (cosine + np.sqrt(roughness**2 + (1 - roughness**2) * cosine**2))


@kernel
def mirror(S, n, plane, polynomial):
    """RESULT = what the surface mirrors of the background. plane: of `plane.describe`."""
    n0, n1, n2 = plane[0], plane[1], plane[2]
    a, b, c, d = polynomial[0], polynomial[1], polynomial[2], polynomial[3]
    e, f, g, h = polynomial[4], polynomial[5], polynomial[6], polynomial[7]
    for i in range(n):
        x, y = S[RAY_X + i], S[RAY_Y + i]
        cosine = (n2 - n0 * x - n1 * y) / math.sqrt(x * x + y * y + ONE)
        t = min(max(ONE - cosine, ZERO), ONE)
        mirrored = a + t * (b + t * (c + t * (d + t * (e + t * (f + t * (g + t * h))))))
        S[RESULT + i] = max(mirrored, ZERO)


@kernel
def glint(S, n, plane, lamp, roughness, reflectance):
    """GLOSS = what the surface mirrors of the lamp at the points U, V: the same lobe, by the light LIT that they
    receive. lamp (3,): its centre along u, v and the normal; roughness, reflectance: as in `fit_reflection`."""
    height, camera_u, camera_v = plane[9], plane[10], plane[11]
    lamp_u, lamp_v, lamp_n = lamp[0], lamp[1], lamp[2]
    square = roughness * roughness
    for i in range(n):
        u, v = S[U + i], S[V + i]
        to_u, to_v, back_u, back_v = lamp_u - u, lamp_v - v, camera_u - u, camera_v - v
        near = ONE / math.sqrt(to_u * to_u + to_v * to_v + lamp_n * lamp_n)
        away = ONE / math.sqrt(back_u * back_u + back_v * back_v + height * height)
        light, view = max(lamp_n * near, ZERO), -height * away
        half_u, half_v, half_n = to_u * near + back_u * away, to_v * near + back_v * away, lamp_n * near + view
        length = half_u * half_u + half_v * half_v + half_n * half_n + f32(1e-9)
        spread = half_n * half_n / length * (square - ONE) + ONE
        grazing = max(ONE - f32(0.5) * math.sqrt(length), ZERO)
        fresnel = reflectance + (ONE - reflectance) * grazing * grazing * grazing * grazing * grazing
        open_both = slant(light, square) * slant(view, square)
        S[GLOSS + i] = S[LIT + i] * square * fresnel / (spread * spread * open_both)


@formula
def slant(cosine, square):
    """Twice the cosine over the share of the microfacets that others leave visible from there (Smith)."""
    return cosine + math.sqrt(square + (ONE - square) * cosine * cosine)
