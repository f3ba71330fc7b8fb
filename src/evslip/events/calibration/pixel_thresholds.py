"""Thresholds of each pixel, where it has fired often enough.

Numbers of ON and OFF events of a pixel are compared with those that a pixel of the mean thresholds makes of the same
light. How they follow the thresholds is measured by simulating the whole sensor with other ones; the thresholds of a
pixel are then those most likely for its numbers and the spread over the sensor (maximum a posteriori of two normal
numbers, the logarithms of the thresholds).
"""

from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import NamedTuple

import numpy as np

from evslip.events.calibration.scene import UNSEEN, Scene
from evslip.events.calibration.simulated import settled, simulated
from evslip.events.pixel_model import LIMITS, PixelModel, own_parameters
from evslip.events.stream import Events

STEP = 0.1
"""Relative change of a threshold by which its influence is measured."""
MODEL_ERROR = 0.05
"""Relative error of a pixel's count that is expected of model and frames."""
SCATTER = 0.3
"""Variance of a pixel's count over its mean: events follow the light, and scatter less than chance alone has it."""
ROUNDS = 2
KNOWN = 0.7
"""A pixel's threshold is known if its error is below this share of the spread over the sensor."""


class PixelThresholds(NamedTuple):
    """Maps of shape (height, width)."""

    on: np.ndarray
    """ON threshold in ln units."""
    off: np.ndarray
    known: np.ndarray
    """Pixels whose own events tell both, bool. The others have a draw of what they may have."""


def pixel_thresholds(
    scenes: Sequence[Scene], grouped: Sequence[np.ndarray], model: PixelModel, seed: int = 0
) -> PixelThresholds:
    """Thresholds of the pixels of a sensor that is fitted already, from scenes of one size.

    grouped: `scene.classes` of each; model: with the mean thresholds and sigma.
    """
    width, height = scenes[0].size
    mean = np.log([float(np.mean(side)) for side in (model.theta_on, model.theta_off) if side is not None])
    spread = model.sigma / np.exp(mean)
    values = np.broadcast_to(mean[:, None, None], (2, height, width)).copy()

    own = own_parameters(asdict(model), "accurate")

    def total(events_of: Callable[[Scene], Events]) -> np.ndarray:
        return np.sum([_counts(events_of(one), one, group) for one, group in zip(scenes, grouped, strict=True)], axis=0)

    def counts(logs: np.ndarray) -> np.ndarray:
        on, off = np.clip(np.exp(logs), *LIMITS["theta_on"])
        parameters = own | {"theta_on": on, "theta_off": off}
        return total(lambda scene: simulated(scene, parameters, seed))

    wanted = total(lambda scene: settled(scene.events, scene))
    made = counts(values)
    slopes = np.stack([_slope(counts(values + STEP * one[:, None, None]), made) for one in np.eye(2)], axis=1)
    deviation = np.zeros((2, 2))
    for _ in range(ROUNDS):
        values, deviation = _likeliest(values, mean, spread, slopes, wanted, made)
        made = counts(values)
    known = np.all(deviation <= KNOWN * spread[:, None, None], axis=0)
    draw = np.random.default_rng(seed).standard_normal(values.shape) * deviation
    on, off = np.clip(np.exp(values + np.where(known, 0.0, draw)), *LIMITS["theta_on"])
    return PixelThresholds(on, off, known)


def _likeliest(
    values: np.ndarray, mean: np.ndarray, spread: np.ndarray, slopes: np.ndarray, wanted: np.ndarray, made: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Logarithms of thresholds, and their standard deviations, of shape (2, height, width), one step from `values`."""
    weights = 1.0 / (SCATTER / (wanted + 0.5) + SCATTER / (made + 0.5) + MODEL_ERROR**2)
    # What the step must explain, were the pixel at the mean: counts' logarithms are taken as linear in thresholds'.
    apart = np.log((wanted + 0.5) / (made + 0.5)) + np.einsum("kc,chw->khw", slopes, values - mean[:, None, None])
    precision = np.einsum("kc,khw,kd->hwcd", slopes, weights, slopes) + np.diag(1.0 / spread**2)
    right = np.einsum("kc,khw->hwc", slopes, weights * apart)
    step = np.linalg.solve(precision, right[..., None])[..., 0]
    deviation = np.sqrt(np.diagonal(np.linalg.inv(precision), axis1=2, axis2=3))
    return mean[:, None, None] + np.moveaxis(step, 2, 0), np.moveaxis(deviation, 2, 0)


def _slope(moved: np.ndarray, made: np.ndarray) -> np.ndarray:
    """Change of the logarithms of all ON and OFF counts by the logarithm of a threshold."""
    return np.log((moved.sum((1, 2)) + 0.5) / (made.sum((1, 2)) + 0.5)) / STEP


def _counts(events: Events, scene: Scene, group: np.ndarray) -> np.ndarray:
    """ON and OFF events of each pixel where frames are not clipped, of shape (2, height, width)."""
    width, height = scene.size
    gap = np.searchsorted(scene.exposures_us, events.t_us, side="right") - 1
    gap = np.clip(gap, 0, len(group) - 1)
    seen = group[gap, events.y, events.x] != UNSEEN
    place = (events.y[seen].astype(np.int64) * width + events.x[seen]) + width * height * ~events.p[seen]
    return np.bincount(place, minlength=2 * width * height).reshape(2, height, width).astype(float)
