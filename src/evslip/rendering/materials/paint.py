"""Gloss of textures and finishes, and the roughness of what shines."""

from typing import NamedTuple

import numpy as np

from evslip.config.sections.object import ObjectSpec

SURFACE_GLOSS, OBJECT_GLOSS, GRIPPER_GLOSS = 0.1, 0.2, 0.3
"""Strength of the highlights of what shines. A smooth dielectric (Fresnel 0.04) with exponent 32 has 0.2."""
EXPONENT = 32
"""Exponent of the fast renderer's highlights (Blinn-Phong)."""
ROUGHNESS = (2 / (EXPONENT + 2)) ** 0.25
"""Its square is the width of the microfacet distribution that has highlights of this exponent (B. Walter et al.,
Microfacet models for refraction through rough surfaces, EGSR 2007)."""
SPECULAR_PER_GLOSS = 2.5
"""A smooth dielectric of reflectance 0.04, half of what the principled model counts as specular = 1, has the fast
renderer's gloss 0.2."""
WIDTH, REFLECTANCE = np.float32(ROUGHNESS**2), np.float32(0.08 * SPECULAR_PER_GLOSS * SURFACE_GLOSS)
"""Alpha of the surface's microfacets, and what they mirror straight from above, 0.08 of that model's specular."""
GLOSSY = ("metal", "plastic", "tile", "wood")
"""Families of textures that shine. The others, and photographs, are matt: earth or cloth that mirrors the sky at low
angles would look wet."""


def family_of(texture: str) -> str:
    """Family of a texture: wood of wood-3."""
    return texture.rpartition("-")[0]


def shines(texture: str) -> bool:
    """Whether a texture mirrors anything."""
    return family_of(texture) in GLOSSY


def gloss_of(texture: str, gloss: float) -> float:
    """Strength of a texture's highlights: 0 if it is matt."""
    return gloss if shines(texture) else 0.0


class Finish(NamedTuple):
    """Reflectance of the microfacets on a body, whatever its texture."""

    reflectance: float
    """Share that the clear layer over the texture mirrors straight from above."""
    metallic: float
    """Share of the surface that is bare metal of the texture's colour, without a matt part."""
    roughness: float
    """Its square is the width of the facets' distribution, their alpha."""


Gloss = float | Finish
"""Strength of highlights with EXPONENT, 0 for matt, or a finish."""
FINISHES = {"plastic": Finish(0.04, 0.0, 0.3), "film": Finish(0.04, 0.0, 0.1), "metal": Finish(0.04, 1.0, 0.4)}


def gloss_of_object(spec: ObjectSpec[float, str]) -> Gloss:
    """Reflectance of an object's finish, or of its texture."""
    if spec.finish == "texture":
        return gloss_of(spec.texture, OBJECT_GLOSS)
    finish = FINISHES.get(spec.finish)
    if finish is None or spec.roughness is None:
        return finish or 0.0
    return finish._replace(roughness=spec.roughness)
