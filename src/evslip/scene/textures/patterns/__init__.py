"""Recipes of the procedural textures: a family a file, each a pure function of its number."""

import numpy as np

from evslip.scene.textures.panoramas import outdoors, room
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
MATERIALS = {
    "wood": wood, "stone": stone, "brick": brick, "weave": weave, "cardboard": cardboard, "paper": paper,
    "metal": metal, "plastic": plastic, "ground": ground, "noise": speckle, "gradient": gradient, "tile": tile,
}  # fmt: skip
"""Families for objects, surfaces and backgrounds: squares of SIZE texels; all but cardboard and paper tile."""
PANORAMAS = {"outdoors": outdoors, "room": room}
"""Families for backgrounds alone: the whole sphere, twice as wide as high, seamless around the horizon."""
FAMILIES = MATERIALS | PANORAMAS


def make(family: str, number: int) -> np.ndarray:
    """Linear RGB of one texture, float32 of shape (rows, columns, 3); multiples of 1/65535 in [0.01, 0.95]."""
    image = FAMILIES[family].draw(generator(0, "train", number, f"texture {family}"), number)
    image = np.clip(image.astype(np.float32, copy=False), DARKEST, BRIGHTEST)
    return np.floor(image * np.float32(65535) + np.float32(0.5)) / np.float32(65535)
