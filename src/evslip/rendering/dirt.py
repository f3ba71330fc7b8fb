"""Dirt on the lens: what dust and finger marks do to the light of an image."""

import numpy as np

from evslip.config.params import Params
from evslip.rendering.camera import Camera
from evslip.utils.seeds import generator

LEAST, MOST = 0.5, 1.5
"""Radius of a spot over the mean one."""


class Dirt:
    """Spots and veiling glare of a sample's lens. Spots are out of focus: they have no edges."""

    def __init__(self, params: Params, camera: Camera):
        self._transmission, self._glare = transmission(params, camera), np.float32(params.lens.glare)

    def darken(self, image: np.ndarray) -> None:
        """Take the light of the spots away, in place, then scatter some of what is left."""
        if self._transmission is not None:
            image *= self._transmission
        if self._glare > 0:
            veil = self._glare * np.float32(image.mean(dtype=np.float64))
            image *= 1 - self._glare
            image += veil


def transmission(params: Params, camera: Camera) -> np.ndarray | None:
    """Share of the light that each pixel gets through the spots, float32 of shape (height, width); None for no spots.

    A spot takes opacity x 2^-(r / radius)^2 at a distance r from its middle. Places, sizes and opacities are shares,
    the same at every resolution.
    """
    own, count = params.lens, round(params.lens.spots)
    if count == 0 or own.spot_opacity == 0:
        return None
    shares = generator(params.seed, params.split, params.index, params.stage("spots")).random((count, 4))
    places = shares[:, :2] * (camera.width, camera.height)
    radii = (LEAST + (MOST - LEAST) * shares[:, 2]) * own.spot_px * camera.width / params.camera.width
    through = np.ones((camera.height, camera.width))
    columns, rows = np.arange(camera.width) + 0.5, np.arange(camera.height)[:, None] + 0.5
    for (x, y), radius, share in zip(places, radii, shares[:, 3], strict=True):
        distance = ((columns - x) ** 2 + (rows - y) ** 2) / radius**2
        through *= 1 - own.spot_opacity * (0.5 + 0.5 * share) * np.exp2(-distance)
    return through.astype(np.float32)
