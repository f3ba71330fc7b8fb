"""A preset from recordings: noise from what stands still, everything else from what moves."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from evslip.events.calibration import still
from evslip.events.calibration.exposures import mean_light, still_pixels
from evslip.events.calibration.fit import Free, fit
from evslip.events.calibration.pixel_thresholds import pixel_thresholds
from evslip.events.calibration.scene import Scene, classes
from evslip.events.calibration.simulated import settled, simulated
from evslip.events.calibration.statistics import statistics
from evslip.events.intervals import intervals_us
from evslip.events.noise_map import unrest
from evslip.events.pixel_model import LIMITS, PixelModel
from evslip.events.stream import Events
from evslip.utils.errors import DataError

FREE = (
    Free("theta_on", 0.06, 1.5, 0.06, 0.025),
    Free("theta_off", 0.06, 1.5, 0.06, 0.025),
    Free("sigma", 0.003, 0.3, 0.2, 0.4),
    Free("cutoff_hz", 5.0, 3000.0, 0.2, 0.09),
    Free("cutoff_dark", 0.01, 1.0, 0.2, 0.2),
    Free("dark", 1e-3, 20 / 255, 0.2, 0.2),
)
LEAST_US = 50.0
"""Least refractory period that is looked for, unless shorter intervals are seen."""
LEAST_MOVED = 2000
"""Fewer events of pixels that are not still tell nothing of thresholds."""
LEAST_KNOWN = 0.5
"""Smaller shares of pixels whose own events tell their thresholds are no maps."""
LEAST_STILL = 200
"""Fewer still pixels tell nothing of noise."""
UNTOLD = 0.5
"""A standard error above this share of what is known beforehand: the recording does not tell."""
RESTLESS = 3.0
"""A scene of more `unrest` is not still."""
SCATTERED = 3.0
"""A `Line.scatter` above this: recordings contradict each other, or leak is no line in light."""
SURE = 1.96
"""Standard errors on either side that 95 % of normal errors stay within."""


class Fact(NamedTuple):
    name: str
    value: float
    low: float
    high: float
    """Ends of the 95 % interval."""
    note: str = ""

    def entries(self) -> dict[str, Any]:
        return {"low": self.low, "high": self.high} | ({"note": self.note} if self.note else {})


class Calibration(NamedTuple):
    """A sensor's parameters as far as its recordings tell them."""

    model: PixelModel
    facts: list[Fact]
    misfit: float
    """See `fit.Found`; not a number where nothing moved."""
    unknown: list[str]
    """Facts that the recordings cannot tell, a line each."""


def calibrate(scenes: Sequence[Scene], seed: int = 0, each_pixel: bool = False) -> Calibration:
    """Parameters of the sensor that has made some recordings with frames; each_pixel: thresholds as maps, where pixels
    have fired often enough. Raises DataError if they tell nothing."""
    masks = [still_pixels(scene.exposures, scene.white) for scene in scenes]
    noise, unknown = _noise(scenes, masks)
    noise = _within_limits(noise)
    known: dict[str, Any] = {fact.name: fact.value for fact in noise}
    moved = [scene for scene, mask in zip(scenes, masks, strict=True) if _moving(scene, mask) >= LEAST_MOVED]
    if not moved:
        unknown.append("thresholds, bandwidth, refractory period: nothing moves in the recordings")
        if not noise:
            raise DataError("recordings: neither still pixels with events nor motion in them; expected either")
        return Calibration(PixelModel(**known), noise, math.nan, unknown)
    grouped = [classes(scene) for scene in moved]
    wanted = [statistics(settled(one.events, one), one, group) for one, group in zip(moved, grouped, strict=True)]
    shortest_us = min(_shortest(scene) for scene in moved)
    free = [*FREE, Free("refractory_us", min(LEAST_US, 0.2 * shortest_us), shortest_us, 0.2, 0.2)]

    def simulate(values: dict[str, float]) -> np.ndarray:
        made = (simulated(scene, known | values, seed) for scene in moved)
        return np.concatenate([statistics(*one) for one in zip(made, moved, grouped, strict=True)])

    found = fit(free, simulate, np.concatenate(wanted), seed)
    facts = []
    for one, value, error, prior in zip(free, found.values, found.errors, found.priors, strict=True):
        spread = math.exp(SURE * error)
        note = "the recordings hardly tell" if error > UNTOLD * prior else ""
        facts.append(Fact(one.name, float(value), max(value / spread, one.low), min(value * spread, one.high), note))
    values: dict[str, Any] = known | {fact.name: fact.value for fact in facts}
    model = PixelModel(**values)
    if each_pixel:
        model = _with_maps(moved, grouped, model, seed, unknown)
    return Calibration(model, facts + noise, found.misfit, unknown)


def calibrate_blind(recordings: Sequence[tuple[Events, tuple[int, int]]]) -> Calibration:
    """Facts that events alone tell of a sensor: noise where the scene is still, at the light that there was.

    recordings: events and (width, height). Raises DataError if they tell nothing."""
    facts, unknown = [], ["thresholds, bandwidth, light: they take three frames or more"]
    still_ones = [(events, size) for events, size in recordings if len(events) > 1 and unrest(events, size) <= RESTLESS]
    if not still_ones:
        raise DataError("recordings: without frames, and the scene moves; expected frames, or a still scene")
    time = sum(1e-6 * float(events.t_us[-1] - events.t_us[0]) * size[0] * size[1] for events, size in still_ones)
    on, off = (sum(int(np.sum(events.p == side)) for events, _ in still_ones) for side in (True, False))
    shot, shot_error = 2.0 * off / time, 2.0 * SURE * math.sqrt(max(off, 1)) / time
    facts.append(Fact("shot_rate_hz", shot, max(0.0, shot - shot_error), shot + shot_error, "ON taken as OFF"))
    facts.append(Fact("shot_white", 1.0, 0.0, 1.0, "not known: the same in any light"))
    # The ends as the value: where shot noise hides nearly all of the leak, what is seen of it tells little.
    seen = np.maximum(0.0, (on - off) + SURE * math.sqrt(on + off) * np.array([0.0, -1.0, 1.0])) / time
    leaks = still.leak_behind_shots(seen, np.full(3, shot)) / still.mean_of_spread(PixelModel().leak_spread)
    leak, low, high = leaks.tolist()
    facts.append(Fact("leak_rate_hz", leak, low, high, "in any light" if low > 0.0 else "the recordings hardly tell"))
    facts = _within_limits(facts)
    parameters: dict[str, Any] = {fact.name: fact.value for fact in facts}
    return Calibration(PixelModel(**parameters), facts, math.nan, unknown)


def _within_limits(facts: list[Fact]) -> list[Fact]:
    """Facts that the pixel model can have: few events of a noisy sensor tell slopes of which no sensor is."""
    return [
        one._replace(**{end: float(np.clip(getattr(one, end), *LIMITS[one.name])) for end in ("value", "low", "high")})
        for one in facts
    ]


def _with_maps(
    scenes: Sequence[Scene], grouped: Sequence[np.ndarray], model: PixelModel, seed: int, unknown: list[str]
) -> PixelModel:
    if len({scene.size for scene in scenes}) > 1:
        unknown.append("thresholds of each pixel: the recordings are of different sizes")
        return model
    found = pixel_thresholds(scenes, grouped, model, seed)
    known = float(found.known.mean())
    if known < LEAST_KNOWN:
        unknown.append(f"thresholds of each pixel: only {known:.1%} of the pixels have fired often enough")
        return model
    return replace(model, theta_on=found.on, theta_off=found.off)


def _shortest(scene: Scene) -> float:
    """Interval of which one in a thousand of a pixel's are shorter, in microseconds: no refractory period is longer."""
    lengths, _ = intervals_us(scene.events, scene.size[0])
    return float(np.clip(np.percentile(lengths, 0.1), 1.0, 1e5)) if len(lengths) else 1e5


def _moving(scene: Scene, mask: np.ndarray) -> int:
    return int(np.sum(~mask[scene.events.y, scene.events.x]))


def _noise(scenes: Sequence[Scene], masks: Sequence[np.ndarray]) -> tuple[list[Fact], list[str]]:
    """Leak and shot noise by light, and what is not known of them."""
    clear, clipped = [], []
    for scene, mask in zip(scenes, masks, strict=True):
        if mask.sum() >= LEAST_STILL:
            inside = scene.events.between(int(scene.exposures_us[0]), int(scene.exposures_us[-1]))
            rates = still.rates_by_light(inside, mean_light(scene.exposures, scene.white), mask, scene.seconds)
            clear.append(rates[0])
            clipped.append(rates[1])
    if not clear:
        return [], ["leak, shot noise: no pixel is still"]
    light, on, off, time = (np.concatenate(parts) for parts in zip(*clear, strict=True))
    if not time.any():
        return [], ["leak, shot noise: every still pixel is clipped"]
    facts, unknown = [], []
    shot = still.line_of(still.shot_scale(light), off, time)
    if shot is None:
        unknown.append(f"shot noise: too few OFF events of still pixels ({(off * time).sum():.0f})")
        facts.append(Fact("shot_rate_hz", 0.0, 0.0, 2.0 * still.LEAST_EVENTS / float(time.sum()), "too few events"))
    else:
        rate, error = 2.0 * shot.dark, 2.0 * SURE * shot.dark_error
        facts.append(Fact("shot_rate_hz", rate, max(0.0, rate - error), rate + error, "ON taken as OFF"))
        share = min(1.0, shot.white / rate * 2.0) if rate > 0.0 else 1.0
        error = 2.0 * SURE * shot.white_error / max(rate, 1e-12)
        facts.append(Fact("shot_white", share, max(0.0, share - error), min(1.0, share + error)))
    shot_on = np.zeros_like(light) if shot is None else shot.at(still.shot_scale(light))
    leaks = still.leak_behind_shots(np.maximum(on - shot_on, 0.0), 2.0 * shot_on)
    leak = still.line_of(light, leaks, time)
    if leak is None:
        unknown.append(f"leak: too few ON events of still pixels ({(on * time).sum():.0f})")
        return facts, unknown
    spread = still.mean_of_spread(PixelModel().leak_spread)
    for name, rate, error in (
        ("leak_rate_hz", leak.dark, leak.dark_error),
        ("leak_light_hz", leak.white - leak.dark, math.hypot(leak.white_error, leak.dark_error)),
    ):
        rate, error = max(rate, 0.0) / spread, SURE * error / spread
        note = "rates by light scatter more than by chance: other lenses, or warmer" if leak.scatter > SCATTERED else ""
        facts.append(Fact(name, rate, max(0.0, rate - error), rate + error, note))
    facts += _clipped(clipped, leak)
    return facts, unknown


def _clipped(rates: Sequence[still.Rates], leak: still.Line) -> list[Fact]:
    """Light behind the white of frames that are clipped, from the leak there."""
    time = sum(float(one.pixel_seconds.sum()) for one in rates)
    events = sum(float((one.on * one.pixel_seconds).sum()) for one in rates)
    slope = leak.white - leak.dark
    if events < still.LEAST_EVENTS or slope <= 0.0:
        return []
    light, error = (events / time - leak.dark) / slope, SURE * math.sqrt(events) / time / slope
    return [Fact("clipped_light", max(1.0, light), max(1.0, light - error), max(1.0, light + error), "for the leak")]
