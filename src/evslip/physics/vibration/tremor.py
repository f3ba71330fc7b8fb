"""Tremor of the arm's joints, which its servos follow."""

import numpy as np

from evslip.config.params import Params
from evslip.physics.vibration.noise import band, shaped_noise
from evslip.scene.motions.steps import step
from evslip.utils.seeds import generator

BEGIN_S = 0.3
"""Time in which it sets in, while the hand comes down."""


def tremor_rad(params: Params, joints: int, t_s: np.ndarray) -> np.ndarray:
    """Angles (n, joints) that are added to those of the plan at evenly spaced times (n,) that begin at 0."""
    spec = params.vibration
    assert spec.tremor_hz is not None
    step_s = float(t_s[1] - t_s[0])
    rng = generator(params.seed, params.split, params.index, "vibration tremor")
    passing = band(spec.tremor_hz, spec.tremor_band_hz, len(t_s), step_s)
    noise = shaped_noise(rng, len(t_s), joints, step_s, passing)
    return np.radians(spec.tremor_deg) * step(t_s, 0.0, BEGIN_S)[:, None] * noise
