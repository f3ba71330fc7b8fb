"""The light on a body whose points are given in camera axes: what all of them share in one frame."""

from typing import NamedTuple

import numpy as np

from evslip.rendering.ambient import turned
from evslip.rendering.casters import Reception, receive, spread
from evslip.rendering.lanes import f32, kernel
from evslip.rendering.occlusion import describe_blockers


class Illumination(NamedTuple):
    ambient: np.ndarray
    """The quadratic form of the light from all around, float32 (4, 4)."""
    lamp: np.ndarray
    """Its centre, float32 (3,)."""
    radius: np.float32
    power: np.float32
    """Luminance x radius^2."""
    blockers: np.ndarray
    """What keeps light from all around away, of `describe_blockers`: the object first."""
    reception: Reception


@kernel
def illuminate(camera, turn, focal, lamp_luminance, lamp_share, ambient, casters, depth):
    """lamp_share: how much of the lamp stands above the surface's horizon. depth: for the blur of shadows over a
    pixel, in metres."""
    lamp = np.zeros(3)
    for k in range(3):
        for j in range(3):
            lamp[k] += turn[j, k] * (casters.lamp[j] - camera[j])
    reception = receive(casters, turn, camera)
    right, down = np.zeros(3), np.zeros(3)
    right[0] = down[1] = depth / focal
    spread(reception, casters, right, down)
    power = lamp_luminance * casters.lamp_radius**2 * lamp_share
    return Illumination(
        turned(ambient, turn), lamp.astype(np.float32), f32(casters.lamp_radius), f32(power),
        describe_blockers(casters, turn, camera), reception,
    )  # fmt: skip


@kernel
def lit_by(light, reception):
    """An Illumination from one without its last part, and that."""
    ambient, lamp, radius, power, blockers = light
    return Illumination(ambient, lamp, radius, power, blockers, reception)
