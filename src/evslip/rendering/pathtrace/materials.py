"""Reflection of surfaces, rough plastic and rough metal whose matt part is the fast renderer's, and what shines."""

from typing import Any, NamedTuple

import numpy as np

from evslip.config.params import Params
from evslip.config.sections.object import ObjectSpec
from evslip.rendering.materials.paint import (
    OBJECT_GLOSS,
    ROUGHNESS,
    SPECULAR_PER_GLOSS,
    Finish,
    family_of,
    gloss_of,
    gloss_of_object,
)
from evslip.rendering.raycast.setting import make_lamp
from evslip.scene.textures import library
from evslip.scene.textures.library import is_panorama

MOST_SPECULAR = 0.08
"""Reflectance of the principled model's specular = 1."""
METALLIC = 0.5
"""Share of the light that a metal's texture mirrors, blurred; the rest is matt, as of worn or brushed metal."""


class Picture(NamedTuple):
    texture: np.ndarray
    """Linear RGB of shape (rows, columns, 3)."""
    wrap: str
    """Continuation beyond its border: repeat or clamp."""


class Paint(NamedTuple):
    albedo: Picture | np.ndarray
    """A texture, or linear RGB of shape (3,)."""
    finish: Finish


def textured(name: str, wrap: str, gloss: float) -> Paint:
    """The paint of a texture; `gloss`: of those that shine. Raises ConfigError for an unreadable one."""
    metallic = METALLIC if family_of(name) == "metal" else 0.0
    return Paint(Picture(library.load(name), wrap), broad(gloss_of(name, gloss), metallic))


def broad(gloss: float, metallic: float = 0.0) -> Finish:
    """The finish that has the fast renderer's highlights of this strength."""
    return Finish(MOST_SPECULAR * SPECULAR_PER_GLOSS * gloss, metallic, ROUGHNESS)


def painted_object(spec: ObjectSpec[float, str], wrap: str) -> Paint:
    """The paint of the object: its texture with its finish. Raises ConfigError."""
    paint, gloss = textured(spec.texture, wrap, OBJECT_GLOSS), gloss_of_object(spec)
    if spec.finish == "texture":
        return paint
    return paint._replace(finish=gloss if isinstance(gloss, Finish) else broad(gloss))


def bsdf(mi: Any, paint: Paint) -> dict[str, Any]:
    """Mitsuba's description of a paint, the same on both sides: rough plastic, or in part rough metal.

    Disney's principled model (B. Burley, Physically-based shading at Disney, SIGGRAPH 2012) adds highlights to a matt
    part, as the fast renderer does; its matt part is the albedo within 10 % (2 % on average) up to 75 degrees from the
    normal. Mitsuba's roughplastic would lose a quarter of it between the layers.
    """
    return {
        "type": "twosided",
        "bsdf": {
            "type": "principled",
            "base_color": _texture(mi, paint.albedo),
            "roughness": paint.finish.roughness,
            "specular": paint.finish.reflectance / MOST_SPECULAR,
            "metallic": paint.finish.metallic,
        },
    }


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
    emitter = {"type": "area", "radiance": radiance, "sampling_weight": 1 - lamp_share(params, texture)}
    return {"type": "sphere", "radius": background.radius_m, "flip_normals": True, "emitter": emitter}


def lamp_share(params: Params, texture: np.ndarray) -> float:
    """Share of the paths that are aimed at the lamp: about its share of the light on the table, for least noise."""
    light = params.light
    direct = light.luminance_cd_m2 * (light.radius_m / light.distance_m) ** 2
    ambient = params.background.luminance_cd_m2 * float(texture.mean())
    return min(max(direct / max(direct + ambient, 1e-30), 0.2), 0.8)


def lamp(params: Params, texture: np.ndarray) -> dict[str, Any]:
    """The light sphere; `texture`: the background's. Raises ConfigError as `make_lamp` does. One that
    reaches beyond the background is drawn nearer and smaller, under the same angle."""
    found, light = make_lamp(params), params.light
    nearer = min(1.0, 0.98 * params.background.radius_m / (light.distance_m + light.radius_m))
    radiance = {"type": "rgb", "value": [found.luminance] * 3}
    return {
        "type": "sphere", "center": [float(x) * nearer for x in found.position], "radius": found.radius_m * nearer,
        "emitter": {"type": "area", "radiance": radiance, "sampling_weight": lamp_share(params, texture)},
    }  # fmt: skip
