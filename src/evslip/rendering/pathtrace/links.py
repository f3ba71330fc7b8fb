"""Where the arm's links are: the Panda's forward kinematics, by MuJoCo."""

from functools import cache
from typing import Any

import mujoco
import numpy as np

from evslip.robot import panda

LINKS = tuple(f"link{k}" for k in range(8))
"""Names of the links' meshes, from the base to the flange."""


@cache
def _model() -> tuple[Any, Any]:
    model = panda(1.0).compile()
    return model, mujoco.MjData(model)


def link_poses(angles_rad: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions (8, 3) in metres and axes as columns (8, 3, 3) of LINKS in the world, for joint angles (7,)."""
    model, data = _model()
    data.qpos[:7] = angles_rad
    mujoco.mj_kinematics(model, data)
    bodies = [model.body(f"panda_{link}").id for link in LINKS]
    return data.xpos[bodies].copy(), data.xmat[bodies].reshape(-1, 3, 3).copy()
