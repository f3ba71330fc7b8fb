"""Calibration of a trained network on its validation windows: how sure it may be."""

from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from evslip.learn.inference import answers
from evslip.learn.networks.speed_network import SpeedNetwork
from evslip.learn.scores.speed import LEAST_SPEED
from evslip.learn.speed_estimate import SpeedEstimate
from evslip.windows.label import Label
from evslip.windows.window_set import Windows

SHARE = 0.68
FEWEST = 20
"""Windows with a fast slip; of fewer the spread is left alone."""


def calibrate(network: SpeedNetwork, windows: Windows) -> None:
    """Correct the network's temperature and the spread of its speeds: 1 before, or those of the detector that training
    started from. Its answers have gone through these, so that what is found is a factor of them."""
    found = answers(network, windows)
    network.temperature *= temperature(found.p_slip, windows.label == Label.SLIP)
    true = windows.rotation_speed_deg_s, windows.slide_speed_mm_s
    for i, (speed, estimate) in enumerate(zip(true, found[1:], strict=True)):
        network.spread[i] *= spread(speed, estimate)


def temperature(p_slip: np.ndarray, slips: np.ndarray) -> float:
    """Divisor of the logits that makes labels likeliest (Guo et al. 2017), with Platt's targets (1999), which keep a
    few windows that are all right from making the detector certain."""
    p = np.clip(p_slip.astype(float), 1e-7, 1 - 1e-7)
    odds = np.log(p / (1 - p))
    target = np.where(slips, (slips.sum() + 1) / (slips.sum() + 2), 1 / ((~slips).sum() + 2))

    def loss(logarithm: float) -> float:
        scaled = odds / np.exp(logarithm)
        return float((np.logaddexp(0, scaled) - target * scaled).mean())

    found: Any = minimize_scalar(loss, bounds=(-2, 3), method="bounded")
    return float(np.exp(found.x))


def spread(true: np.ndarray, estimate: SpeedEstimate) -> float:
    """Factor of the scales with which the interval of 68 % holds that share of the fast slips' speeds."""
    fast = true > LEAST_SPEED  # not where nobody knows
    if fast.sum() < FEWEST:
        return 1.0
    errors = np.abs(np.log1p(true) - np.log1p(estimate.median))[fast] / estimate.scale[fast]
    return float(np.quantile(errors, SHARE) / -np.log(1 - SHARE))
