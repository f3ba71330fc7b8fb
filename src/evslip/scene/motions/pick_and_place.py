"""The paper's motion: tilt sideways on the way to the goal, then back upright."""

from typing import Any

import numpy as np

from evslip.scene.motions.steps import scale, step, tilt_s

PAUSE_S, LAST_PAUSE_S = 0.4, 0.15
"""Nominal rests in the tilt and after it."""


def phases(motion: Any) -> dict[str, float]:
    return {
        "tilt": tilt_s(motion) + PAUSE_S * scale(motion),
        "back": tilt_s(motion) + LAST_PAUSE_S * scale(motion),
    }


def path(motion: Any, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    turn = tilt_s(motion)
    back = phases(motion)["tilt"]
    sideways = step(t_s, 0, back + turn)
    way = np.stack([motion.move_x_m * sideways, motion.move_y_m * sideways, np.zeros_like(t_s)], axis=-1)
    return way, np.radians(motion.tilt_deg) * (step(t_s, 0, turn) - step(t_s, back, turn))
