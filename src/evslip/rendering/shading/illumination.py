"""The light on a body whose points are given in camera axes: what all of them share in one frame."""

from typing import NamedTuple

import numpy as np

from evslip.rendering.scratch import f32, kernel
from evslip.rendering.shading.ambient import turned
from evslip.rendering.shadows.casters import Reception, receive, spread
from evslip.rendering.shadows.occlusion import describe_blockers


class Illumination(NamedTuple):
    ambient: np.ndarray
    """The quadratic form of the light from all around, float32 (4, 4)."""
    lamp: np.ndarray
    """Its centre, float32 (3,)."""
    radius: np.float32
    power: np.float32
    """Luminance x radius^2."""
    blockers: np.ndarray
    """Boxes that keep light from all around away, of `describe_blockers`: the object first."""
    reception: Reception


@kernel
def illuminate(view, setting, casters, depth):
    """view: `viewpoint.View`; setting: `setting.Setting`; depth: of the body, in metres, for the blur of shadows over a
    pixel."""
    lamp, camera, turn, centre = setting.lamp, view.camera, view.turn, np.zeros(3)
    for k in range(3):
        for j in range(3):
            centre[k] += turn[j, k] * (lamp.position[j] - camera[j])
    reception = receive(casters, turn, camera)
    right, down = np.zeros(3), np.zeros(3)
    right[0] = down[1] = depth / view.focal
    spread(reception, casters, right, down)
    ambient, blockers = turned(setting.ambient.matrix, turn), describe_blockers(casters, turn, camera)
    return Illumination(ambient, centre.astype(np.float32), f32(lamp.radius_m), power_of(lamp), blockers, reception)


@kernel
def power_of(lamp):
    """Luminance x radius^2 of what stands above the surface's horizon."""
    return f32(lamp.luminance * lamp.radius_m**2 * lamp.share)
