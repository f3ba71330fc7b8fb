"""The hand holds the object still above the table."""

from typing import Any

import numpy as np


def phases(motion: Any) -> dict[str, float]:
    return {"hold": motion.hold_s}


def path(motion: Any, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.zeros((len(t_s), 3)), np.zeros(len(t_s))
