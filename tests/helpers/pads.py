"""Rectangle that the pads touch."""

import numpy as np

from evslip.config.params import Params
from evslip.physics.grip import grasp


def contact_patch(params: Params) -> tuple[float, float, float, float]:
    """Rectangle (x0, x1, z0, z1) in metres around what the pads touch, about the tool centre; x along the width, z
    up."""
    points = np.concatenate([pad.corners for pad in grasp(params).pads])
    (x0, z0), (x1, z1) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    return x0, x1, z0, z1
