"""The hand turns the object about the closing axis, to either side in turns."""

from typing import Any

import numpy as np

from evslip.scene.motions.steps import scale, step, tilt_s

PAUSE_S = 0.2


def phases(motion: Any) -> dict[str, float]:
    return {"rotate": (2 * motion.cycles + 1) * tilt_s(motion) + PAUSE_S * scale(motion)}


def path(motion: Any, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    swing = tilt_s(motion)
    sides = np.array([0, *([1, -1] * motion.cycles), 0])
    turn = sum(change * step(t_s, k * swing, swing) for k, change in enumerate(np.diff(sides)))
    return np.zeros((len(t_s), 3)), np.radians(motion.tilt_deg) * turn
