"""The hand holds the object still above the table."""

import numpy as np

from evslip.config.schema import MotionSpec


def phases(motion: MotionSpec[float, str]) -> dict[str, float]:
    return {"hold": motion.hold_s}


def path(motion: MotionSpec[float, str], t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.zeros((len(t_s), 3)), np.zeros(len(t_s))
