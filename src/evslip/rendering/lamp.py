"""Place of the lamp."""

import math

import numpy as np

from evslip.config.params import Params


def lamp_position(params: Params) -> np.ndarray:
    """Centre of the lamp in the world in metres, of shape (3,)."""
    light = params.light
    azimuth, polar = math.radians(light.azimuth_deg), math.radians(light.polar_deg)
    direction = [math.sin(polar) * math.cos(azimuth), math.sin(polar) * math.sin(azimuth), math.cos(polar)]
    return light.distance_m * np.array(direction)
