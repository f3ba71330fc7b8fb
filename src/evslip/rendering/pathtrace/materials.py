"""How surfaces reflect: rough plastic whose matt part is that of the fast renderer, and rough metal."""

import math
from typing import Any, NamedTuple

import numpy as np

from evslip.params import Params
from evslip.rendering.setting import make_lamp
from evslip.textures import is_panorama

EXPONENT = 32
"""Of the fast renderer's highlights (Blinn-Phong)."""
ROUGHNESS = math.sqrt(2 / (EXPONENT + 2))
"""Width of the microfacet distribution that has highlights of this exponent (B. Walter et al., Microfacet models for
refraction through rough surfaces, EGSR 2007)."""
GLOSS_PER_FRESNEL = 5.0
"""A smooth dielectric of reflectance 0.04 has the fast renderer's gloss 0.2."""
METAL_SHARE = 0.5
"""Of a metal's light that it mirrors, blurred; the rest is matt, as worn or brushed metal is."""


class Picture(NamedTuple):
    texture: np.ndarray
    """Linear RGB of shape (rows, columns, 3)."""
    wrap: str
    """What lies beyond its border: repeat or clamp."""


class Paint(NamedTuple):
    """What a surface looks like."""

    albedo: Picture | np.ndarray
    """A texture, or linear RGB of shape (3,)."""
    gloss: float
    """Strength of the highlights, as of the fast renderer."""
    is_metal: bool = False


def bsdf(mi: Any, paint: Paint) -> dict[str, Any]:
    """Mitsuba's description of a paint, the same on both sides.

    Rough plastic without colour shifts inside: seen and lit from above, its matt part is the albedo within 2 %. Towards
    grazing angles it gives light to the mirror, which the fast renderer's sum of both does not.
    """
    fresnel = math.sqrt(paint.gloss / GLOSS_PER_FRESNEL)
    plastic = {
        "type": "roughplastic", "distribution": "ggx", "alpha": ROUGHNESS, "nonlinear": False,
        "int_ior": (1 + fresnel) / (1 - fresnel), "ext_ior": 1.0, "diffuse_reflectance": _texture(mi, paint.albedo),
    }  # fmt: skip
    if not paint.is_metal:
        return {"type": "twosided", "bsdf": plastic}
    metal = {
        "type": "roughconductor", "material": "none", "distribution": "ggx", "alpha": ROUGHNESS,
        "specular_reflectance": _texture(mi, paint.albedo),
    }  # fmt: skip
    return {"type": "blendbsdf", "weight": METAL_SHARE, "matt": {"type": "twosided", "bsdf": plastic}, "metal": metal}


def _texture(mi: Any, albedo: Picture | np.ndarray) -> dict[str, Any]:
    if isinstance(albedo, Picture):
        image = mi.Bitmap(np.array(albedo.texture, np.float32, order="C"))
        return {"type": "bitmap", "bitmap": image, "raw": True, "wrap_mode": albedo.wrap}
    return {"type": "rgb", "value": [float(value) for value in albedo]}


def sky(mi: Any, params: Params, texture: np.ndarray) -> dict[str, Any]:
    """The background: a luminous sphere with its texture inside (rows, columns, 3)."""
    background = params.background
    aspect = texture.shape[1] / texture.shape[0]
    # Mitsuba's sphere: u is the azimuth in turns, v the angle from the zenith in half turns.
    if is_panorama(texture):
        place = mi.ScalarTransform3f()
    else:
        count = max(1, round(360.0 / background.tile_deg))
        place = mi.ScalarTransform3f(np.array([[count, 0, 0], [0, count * aspect / 2, -count * aspect / 4], [0, 0, 1]]))
    light = np.ascontiguousarray(texture * np.float32(background.luminance_cd_m2))
    radiance = {"type": "bitmap", "bitmap": mi.Bitmap(light), "raw": True, "to_uv": place}
    emitter = {"type": "area", "radiance": radiance}
    return {"type": "sphere", "radius": background.radius_m, "flip_normals": True, "emitter": emitter}


def lamp(params: Params) -> dict[str, Any]:
    """The light sphere. Raises ConfigError as `make_lamp` does. One that
    reaches beyond the background is drawn nearer and smaller, under the same angle."""
    found, light = make_lamp(params), params.light
    nearer = min(1.0, 0.98 * params.background.radius_m / (light.distance_m + light.radius_m))
    radiance = {"type": "rgb", "value": [found.luminance] * 3}
    return {
        "type": "sphere", "center": [float(x) * nearer for x in found.position], "radius": found.radius_m * nearer,
        "emitter": {"type": "area", "radiance": radiance},
    }  # fmt: skip
