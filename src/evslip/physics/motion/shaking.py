"""Shaking of the hand for a while."""

import numpy as np

from evslip.config.params import Params
from evslip.physics.motion.pace import begin_s
from evslip.scene.motions.steps import step


def shaking_m(params: Params, bounds: dict[str, tuple[float, float]], t_s: np.ndarray) -> np.ndarray:
    """Way of the tool centre by shaking, (n, 3), of a motion with these phases at times (n,): a sine that grows and
    dies away within a period."""
    spec = params.disturbance
    if spec.kind != "shake":
        return np.zeros((len(t_s), 3))
    since_s = t_s - begin_s(params, bounds)
    ramp = min(1 / spec.shake_hz, spec.shake_s / 2)
    swell = step(since_s, 0, ramp) - step(since_s, spec.shake_s - ramp, ramp)
    angle = np.radians(spec.direction_deg)
    way = spec.shake_m * swell * np.sin(2 * np.pi * spec.shake_hz * since_s)
    return way[:, None] * [np.cos(angle), 0, np.sin(angle)]
