"""The hand shakes the object along one axis of the world: a sine that grows from rest and dies away again."""

from typing import Any

import numpy as np

from evslip.scene.motions.steps import scale, step

PAUSE_S = 0.2


def phases(motion: Any) -> dict[str, float]:
    return {"shake": _length_s(motion) + PAUSE_S * scale(motion)}


def path(motion: Any, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    length = _length_s(motion)
    ramp = min(1 / motion.frequency_hz, length / 2)
    swell = step(t_s, 0, ramp) - step(t_s, length - ramp, ramp)
    way = np.zeros((len(t_s), 3))
    way[:, "xyz".index(motion.axis)] = motion.amplitude_m * swell * np.sin(2 * np.pi * motion.frequency_hz * t_s)
    return way, np.zeros(len(t_s))


def _length_s(motion: Any) -> float:
    return motion.cycles / motion.frequency_hz
