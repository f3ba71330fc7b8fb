"""Recipes of the procedural textures: a family a file, each recipe a pure function of a random generator."""

from collections.abc import Callable

import numpy as np

from evslip.scene.textures.panoramas import outdoors, room
from evslip.scene.textures.panoramas.panorama import complete
from evslip.scene.textures.patterns import (
    brick,
    cardboard,
    gradient,
    ground,
    metal,
    paper,
    plastic,
    speckle,
    stone,
    tile,
    weave,
    wood,
)
from evslip.utils.seeds import generator

DARKEST, BRIGHTEST = 0.01, 0.95
"""Reflectances of the blackest and the whitest matt things."""
_MODULES = {
    "wood": wood, "stone": stone, "brick": brick, "weave": weave, "cardboard": cardboard, "paper": paper,
    "metal": metal, "plastic": plastic, "ground": ground, "noise": speckle, "gradient": gradient, "tile": tile,
}  # fmt: skip
Recipe = Callable[[np.random.Generator], np.ndarray]
MATERIALS: dict[str, tuple[Recipe, ...]] = {name: module.RECIPES for name, module in _MODULES.items()}
"""Families for objects, surfaces and backgrounds: squares of SIZE texels; all but cardboard and paper tile."""
PANORAMAS: dict[str, tuple[Recipe, ...]] = {"outdoors": outdoors.RECIPES, "room": room.RECIPES}
"""Families for backgrounds alone: the whole sphere, twice as wide as high, seamless around the horizon; recipes draw
its upper half."""
FAMILIES = MATERIALS | PANORAMAS


def make(family: str, number: int) -> np.ndarray:
    """Linear RGB of one texture, float32 of shape (rows, columns, 3); multiples of 1/65535 in [0.01, 0.95]."""
    image = FAMILIES[family][number](generator(0, "train", number, f"texture {family}"))
    if family in PANORAMAS:
        image = complete(image)
    image = np.clip(image.astype(np.float32, copy=False), DARKEST, BRIGHTEST)
    return np.floor(image * np.float32(65535) + np.float32(0.5)) / np.float32(65535)
