"""Textures ready for sampling, lamp and ambient light: they stay the same through a sample."""

import math
from typing import NamedTuple

import numpy as np

from evslip.config.params import Params
from evslip.rendering.geometry.plane import describe
from evslip.rendering.lamp import lamp_position
from evslip.rendering.materials.paint import REFLECTANCE, WIDTH, shines
from evslip.rendering.materials.texels import bake, halve
from evslip.rendering.raycast.layers import LUMA_WEIGHTS
from evslip.rendering.shading.ambient import Ambient, surround
from evslip.rendering.shading.environment_reflection import TERMS, fit_reflection
from evslip.rendering.viewpoint import View
from evslip.scene.textures import library

SKY_TEXELS = 64
"""Side of the coarse background texture that the ambient light is taken from."""
RED, GREEN, BLUE, LUMA = range(4)


class Lamp(NamedTuple):
    position: np.ndarray
    """Centre in the world in metres, of shape (3,)."""
    radius_m: float
    luminance: float
    """In cd/m2."""
    share: float
    """Share of its disc that stands above the horizon of the surface."""


class Table(NamedTuple):
    """The surface."""

    cells: np.ndarray
    """Texels of `texels.bake`."""
    levels: np.ndarray
    tile_m: float
    ambient: float
    """Light from all around on it, as luminance of white."""
    reflectance: float
    """Seen straight from above; 0 if it is matt."""
    reflection: np.ndarray
    """Light of the background that it mirrors, see `environment_reflection.fit_reflection`; zeros if it is matt."""


class Sky(NamedTuple):
    cells: np.ndarray
    levels: np.ndarray
    repetitions: float
    """Repetitions of the texture around the horizon."""
    radius_m: float
    luminance: float
    """Luminance of white, in cd/m2."""


class Setting(NamedTuple):
    """One colour channel (or luminance) of everything that is lit."""

    lamp: Lamp
    ambient: Ambient
    table: Table
    sky: Sky


def channel_of(image: np.ndarray, channel: int) -> np.ndarray:
    """One channel of linear RGB (rows, columns, 3): RED, GREEN, BLUE or LUMA."""
    return image @ LUMA_WEIGHTS.astype(np.float32) if channel == LUMA else np.ascontiguousarray(image[..., channel])


def prepare(params: Params, channel: int = LUMA) -> Setting:
    """The setting of a sample. Raises ConfigError for unreadable textures."""
    light, background = params.light, params.background
    lamp = make_lamp(params)
    sky = channel_of(library.load(background.texture, is_background=True), channel)
    table = channel_of(library.load(params.surface.texture), channel)
    repetitions = 1 if library.is_panorama(sky) else max(1, round(360.0 / background.tile_deg))
    white = light.luminance_cd_m2 * light.radius_m**2 / light.distance_m**2 * math.cos(math.radians(light.polar_deg))
    coarse = sky
    while len(coarse) > SKY_TEXELS:
        coarse = halve(halve(coarse, 0), 1)
    ambient = surround(coarse, background.luminance_cd_m2, repetitions, white, float(table.mean()))
    reflectance = float(REFLECTANCE) if shines(params.surface.texture) else 0.0
    mirrored = np.zeros(TERMS, np.float32)
    if reflectance:
        mirrored = fit_reflection(ambient.heights, float(WIDTH), reflectance)
    surface = Table(*bake(table, wrap=True), params.surface.tile_m, ambient.surface, reflectance, mirrored)
    around = Sky(*bake(sky, wrap=True), float(repetitions), background.radius_m, background.luminance_cd_m2)
    return Setting(lamp, ambient, surface, around)


def table_origin(view: View, tile_m: float) -> np.ndarray:
    """Point of the surface below the camera, on a whole repetition of the texture, so that single precision suffices
    for places relative to it."""
    return np.append(np.floor(view.camera[:2] / tile_m) * tile_m, 0.0)


def table_plane(view: View, setting: Setting) -> np.ndarray:
    """The surface, of `plane.describe`."""
    return describe(table_origin(view, setting.table.tile_m), np.eye(3), view.turn, view.camera)


def make_lamp(params: Params) -> Lamp:
    light = params.light
    height = min(1.0, light.distance_m * math.cos(math.radians(light.polar_deg)) / light.radius_m)
    share = 0.5 + (height * math.sqrt(max(0.0, 1 - height * height)) + math.asin(height)) / math.pi
    return Lamp(lamp_position(params), light.radius_m, light.luminance_cd_m2, share)
