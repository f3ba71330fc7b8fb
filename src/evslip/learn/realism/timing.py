"""Times of events: intervals at a pixel, and the spectrum of the rate of all pixels."""

import numpy as np

from evslip.events.stream import Events

RATE_STEP_US = 1000
"""Step of the rate whose spectrum is taken."""
SEGMENT = 256
"""Steps of a segment of Welch's method: frequencies are 3.9 Hz apart."""


def ks_distance(first: np.ndarray, second: np.ndarray) -> float:
    """Kolmogorov-Smirnov distance: the largest difference of the two distribution functions; nan for an empty one."""
    if not (len(first) and len(second)):
        return float("nan")
    places = np.concatenate([first, second])
    shares = [np.searchsorted(np.sort(values), places, "right") / len(values) for values in (first, second)]
    return float(np.abs(shares[0] - shares[1]).max())


def rate_spectrum(events: Events, start_us: int, end_us: int) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies in Hz and the power density of the rate of all pixels, (events/s)^2/Hz, by Welch's method."""
    from scipy.signal import welch

    edges = np.arange(start_us, end_us + 1, RATE_STEP_US)
    rate = np.histogram(events.t_us, edges)[0] * (1e6 / RATE_STEP_US)
    hz, power = welch(rate, fs=1e6 / RATE_STEP_US, nperseg=min(SEGMENT, len(rate)))
    return hz[1:], power[1:]


def spectrum_distance_db(first: np.ndarray, second: np.ndarray) -> float:
    """Root mean square over the frequencies of the ratio of two power densities in decibels; nan where one is 0."""
    if not (first.min(initial=1) > 0 and second.min(initial=1) > 0 and len(first)):
        return float("nan")
    return float(np.sqrt(np.mean((10 * np.log10(first / second)) ** 2)))
