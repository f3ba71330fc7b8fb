"""Flicker of the light: a line in the spectrum of ON less OFF events, in step in all parts of the picture.

Where light flickers, ON events come while it grows and OFF events while it falls: their difference has the light's own
period, while their sum has half of it. What moves makes both, which mostly cancel.
"""

from typing import Literal, NamedTuple

import numpy as np

from evslip.events.quality.rates import SIDE, Rates

LEAST_SEGMENT, MOST_SEGMENT = 128, 4096
"""Steps of a segment of Welch's method."""
LOWEST_HZ = 20.0
"""Below it lies what moves."""
SURE = 1e-6
"""Probability that noise alone has so high a peak anywhere."""
IN_PHASE = 0.5
LEAST_BLOCKS = 4.0
AROUND = 20
"""Frequencies on either side whose median is the noise."""


class Flicker(NamedTuple):
    """The highest peak of the spectrum."""

    frequency_hz: float
    resolution_hz: float
    """Half the distance to the next frequency that the recording can tell from it."""
    false_alarm: float
    """Probability of so high a peak in noise."""
    in_phase: float
    """How far the parts of the picture flicker in step: 1 entirely, about 0.1 by chance."""
    blocks: float
    """Parts of the picture, of 16, that take part."""
    synchrony: float
    """Share of the events that come in step with it: 1 where all ON events come at one moment of the period and all OFF
    events half a period later."""

    @property
    def cause(self) -> Literal["lamp", "unclear", "none"]:
        """Lamp: all parts of the picture in step. Unclear: a part of the picture, or not in step, as of vibration."""
        if self.false_alarm > SURE:
            return "none"
        return "lamp" if self.in_phase >= IN_PHASE and self.blocks >= LEAST_BLOCKS else "unclear"


def flicker(rates: Rates) -> Flicker | None:
    """The peak; None where the recording is too short or has too few events to have one."""
    from scipy.ndimage import median_filter
    from scipy.stats import gamma

    signed, steps = rates.blocks.sum(1), len(rates.blocks)
    segment = 1 << max(0, (min(steps // 4, MOST_SEGMENT)).bit_length() - 1)
    if segment < LEAST_SEGMENT or rates.total.sum() < 2 * segment:
        return None
    window = np.hanning(segment)
    starts = np.arange(0, steps - segment + 1, segment // 2)
    power = np.zeros(segment // 2 + 1)
    for start in starts:
        part = signed[start : start + segment]
        power += np.abs(np.fft.rfft((part - part.mean()) * window)) ** 2
    hz = np.fft.rfftfreq(segment, rates.step_us / 1e6)
    usual = np.maximum(median_filter(power, 2 * AROUND + 1, mode="nearest"), power.max() * 1e-12 + 1e-12)
    ratio, eligible = power / usual, (hz >= LOWEST_HZ) & (hz < 0.95 * hz[-1]) & ~_of_the_clock(hz, rates)
    if not eligible.any():
        return None
    # Segments overlap by half and share some noise; their mean is spread like that of 0.8 as many.
    free = max(1.0, 0.8 * len(starts))

    def false_alarm(at: int) -> float:
        return float(min(1.0, np.count_nonzero(eligible) * gamma.sf(ratio[at] * free, free)))

    peak = int(np.argmax(np.where(eligible, ratio, 0)))
    for parts in (3, 2):  # the light's own period, where a harmonic stands out more
        below = round(peak / parts)
        near = [k for k in range(below - 1, below + 2) if eligible[k] and power[k] >= 0.3 * power[peak]]
        if near:
            best = max(near, key=lambda k: float(ratio[k]))
            if false_alarm(best) < SURE:
                peak = best
                break
    frequency = _between(power, peak) * (hz[1] - hz[0])
    return Flicker(frequency, float(hz[1] - hz[0]) / 2, false_alarm(peak), *_in_step(rates, starts, window, frequency))


def _of_the_clock(hz: np.ndarray, rates: Rates) -> np.ndarray:
    """Frequencies at which the time stamps' own steps beat with the steps of the counts."""
    if rates.resolution_us < 20:
        return np.zeros(len(hz), bool)
    sampling, clock = 1e6 / rates.step_us, 1e6 / rates.resolution_us
    beats = np.array([clock * k for k in range(1, 9)]) % sampling
    beats = np.minimum(beats, sampling - beats)
    return (np.abs(hz[:, None] - beats) < 2 * (hz[1] - hz[0])).any(1)


def _between(power: np.ndarray, peak: int) -> float:
    """Place of a peak by the parabola through its logarithm and those beside it."""
    if not 0 < peak < len(power) - 1 or power[peak - 1 : peak + 2].min() <= 0:
        return float(peak)
    left, top, right = np.log(power[peak - 1 : peak + 2])
    bend = left - 2 * top + right
    return peak + float(np.clip(0.5 * (left - right) / bend, -0.5, 0.5)) if bend < 0 else float(peak)


def _in_step(rates: Rates, starts: np.ndarray, window: np.ndarray, frequency_hz: float) -> tuple[float, float, float]:
    """in_phase, blocks and synchrony of a Flicker."""
    wave = window * np.exp(-2j * np.pi * frequency_hz * np.arange(len(window)) * rates.step_us / 1e6)
    parts = [rates.blocks[start : start + len(window)] for start in starts]
    found = np.array([wave @ (part - part.mean(0)) for part in parts])
    sizes = np.abs(found)
    together = np.abs(found.sum(1))
    in_phase = float((together**2).sum() / max((sizes.sum(1) ** 2).sum(), 1e-12))
    mean = np.sqrt((sizes**2).mean(0))
    blocks = float(min(SIDE * SIDE, mean.sum() ** 2 / max((mean**2).sum(), 1e-12)))
    events = sum(float(window @ rates.total[start : start + len(window)]) for start in starts)
    return in_phase, blocks, float(min(1.0, together.sum() / max(events, 1e-12)))
