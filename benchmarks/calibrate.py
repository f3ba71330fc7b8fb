"""Whether `evslip calibrate` finds the parameters of sensors that are known: those of simulated recordings.

    python benchmarks/calibrate.py [--count 20] [--first 0] [--out FOLDER]

Each random sensor, with mismatch, leak and shot noise, sees a pattern that moves beside a still part, and takes frames
of 8 bits with noise at 25 Hz. Calibration gets these frames and the events, nothing else. Printed are found over true
values, their 95 % intervals, and how many intervals hold the truth.
"""

import argparse
import math
import time
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from evslip.events import EventCamera
from evslip.events.calibration.calibration import Calibration, calibrate
from evslip.events.calibration.scene import Scene
from evslip.exchange.calibrating import scene_from

WIDTH, HEIGHT, STILL = 128, 96, 48
"""Pixels, and the columns of them that see a still part."""
SECONDS, FRAME_US, STEP_US, READ_NOISE = 2.4, 40_000, 1000, 0.7
"""Length of a recording, times between its frames and between those that the sensor sees; noise of a frame, codes."""
BEFORE_US = 6e7
"""Time for which the sensor has looked at the first frame before: leak and noise are steady then."""
TOLERANCES = {"theta_on": 0.05, "theta_off": 0.05, "cutoff_hz": 0.15, "leak": 0.10, "shot": 0.10}


@dataclass(frozen=True)
class Truth:
    """Parameters of a sensor."""

    theta_on: float
    theta_off: float
    sigma: float
    cutoff_hz: float
    refractory_us: float
    leak_rate_hz: float
    leak_light_hz: float
    shot_rate_hz: float


def random_sensor(rng: np.random.Generator) -> Truth:
    def between(low: float, high: float) -> float:
        return float(math.exp(rng.uniform(math.log(low), math.log(high))))

    theta = between(0.15, 0.35)
    return Truth(
        theta * between(0.85, 1.18),
        theta * between(0.85, 1.18),
        theta * between(0.05, 0.2),
        between(15.0, 150.0),
        between(200.0, 2000.0),
        between(0.02, 0.2),
        between(0.1, 1.0),
        between(0.1, 1.0),
    )


def record(truth: Truth, seed: int) -> Scene:
    """What calibration gets of a recording."""
    rng = np.random.default_rng(seed)
    sensor = EventCamera("clean", size=(WIDTH, HEIGHT), seed=seed, **truth.__dict__)
    exposures, times_us = [], []

    def watched() -> Iterator[tuple[float, np.ndarray]]:
        for t_us, light in moving(rng, seed):
            if not times_us:
                yield t_us - BEFORE_US, light
            if t_us % FRAME_US == 0:
                codes = np.rint(255 * light + READ_NOISE * rng.standard_normal(light.shape))
                exposures.append(np.clip(codes, 0, 255).astype(np.uint8))
                times_us.append(float(t_us))
            yield t_us, light

    events = sensor.run(watched())
    return scene_from(events, np.array(times_us), np.stack(exposures))


def moving(rng: np.random.Generator, seed: int) -> Iterator[tuple[int, np.ndarray]]:
    """Times and luminance of a pattern that moves to and fro along a curve, beside a still ramp of light."""
    side = 512
    frequency = np.hypot(np.fft.fftfreq(side)[:, None], np.fft.rfftfreq(side)[None])
    # Natural images have amplitudes of 1 / f; what is finer than three pixels a lens would blur.
    amplitude = np.exp(-((frequency / 0.16) ** 2)) / np.maximum(frequency, 4 / side)
    pattern = np.fft.irfft2(amplitude * np.exp(2j * np.pi * rng.random(frequency.shape)), (side, side))
    light = np.clip(0.3 * np.exp(0.6 * pattern / pattern.std()), 0.02, 0.95).astype(np.float32)
    ramp = np.tile(np.geomspace(0.05, 0.95, HEIGHT, dtype=np.float32)[:, None], (1, STILL))
    for t_us in range(0, int(1e6 * SECONDS) + 1, STEP_US):
        t = t_us / 1e6
        x, y = 150 + 30 * math.sin(1.7 * t + seed), 150 + 20 * math.sin(2.3 * t + 2 * seed)
        place = np.array([[1, 0, x], [0, 1, y]])
        flags = cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP
        shown = np.maximum(cv2.warpAffine(light, place, (WIDTH - STILL, HEIGHT), flags=flags), 0.01)
        yield t_us, np.hstack([ramp, shown])


def compared(truth: Truth, found: Calibration) -> dict[str, tuple[float, bool]]:
    """Found over true value, and whether the truth is in the interval, by parameter."""
    facts = {fact.name: fact for fact in found.facts}
    pairs = {}
    for name in ("theta_on", "theta_off", "sigma", "cutoff_hz", "refractory_us"):
        fact, true = facts[name], getattr(truth, name)
        pairs[name] = fact.value / true, fact.low <= true <= fact.high
    dark, light = facts["leak_rate_hz"], facts["leak_light_hz"]
    middle = truth.leak_rate_hz + 0.3 * truth.leak_light_hz
    pairs["leak"] = (
        (dark.value + 0.3 * light.value) / middle,
        dark.low <= truth.leak_rate_hz <= dark.high and light.low <= truth.leak_light_hz <= light.high,
    )
    shot = facts["shot_rate_hz"]
    pairs["shot"] = shot.value / truth.shot_rate_hz, shot.low <= truth.shot_rate_hz <= shot.high
    return pairs


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    options = parser.parse_args()
    rows: list[dict[str, tuple[float, bool]]] = []
    for seed in range(options.first, options.first + options.count):
        start = time.perf_counter()
        truth = random_sensor(np.random.default_rng(seed))
        found = calibrate([record(truth, seed)])
        rows.append(compared(truth, found))
        line = "  ".join(f"{name} {ratio:.3f}{'' if inside else '!'}" for name, (ratio, inside) in rows[-1].items())
        print(f"{seed:3}  {line}  misfit {found.misfit:.2f}  {time.perf_counter() - start:.0f} s", flush=True)
    print("\n| parameter | median of found / true | within | tolerance | truth in the interval |")
    print("|---|---|---|---|---|")
    for name in rows[0]:
        ratios = np.array([row[name][0] for row in rows])
        inside = sum(row[name][1] for row in rows)
        asked = TOLERANCES.get(name)
        within = "" if asked is None else f"{np.sum(np.abs(ratios - 1) <= asked)} of {len(rows)}"
        bound = "" if asked is None else f"{asked:.0%}"
        print(f"| {name} | {np.median(ratios):.3f} | {within} | {bound} | {inside} of {len(rows)} |")


if __name__ == "__main__":
    main()
