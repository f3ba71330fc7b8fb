"""Noise of a real sensor: measured, kept in a file, and brought back."""

import io
from pathlib import Path

import numpy as np

from evslip.events.stream import Events
from evslip.utils import atomic, npz
from evslip.utils.errors import DataError

MOST_BYTES = 1 << 30
"""Size of a noise map: that of a sensor of 8,000 x 8,000 pixels."""


def measure_noise(events: Events, size: tuple[int, int]) -> np.ndarray:
    """Noise rates from a recording of a still scene: ON and OFF events a second of each pixel, for `noise_map`.

    size: (width, height). Returns float64 of shape (2, height, width). The rates of rare events need a long recording:
    a pixel's rate is known to 1 / sqrt(its number of events). Raises DataError when there is nothing to measure.
    """
    width, height = size
    if events.count < 2 or events.t_us[-1] == events.t_us[0]:
        raise DataError(
            f"noise calibration: the recording holds {events.count} events; record a still scene for longer"
        )
    if events.x.max() >= width or events.y.max() >= height:
        raise DataError(
            f"noise calibration: events reach column {events.x.max()} and row {events.y.max()}, "
            f"outside of {width}x{height} pixels"
        )
    # The recording goes on before its first and after its last event; n events have n - 1 gaps between them.
    seconds = 1e-6 * float(events.t_us[-1] - events.t_us[0]) * events.count / (events.count - 1)
    place = (np.where(events.p, 0, height) + events.y.astype(np.int64)) * width + events.x
    return np.bincount(place, minlength=2 * height * width).reshape(2, height, width) / seconds


def unrest(events: Events, size: tuple[int, int]) -> float:
    """Unrest of a recording: how much more the pixels' counts differ between its halves than chance allows.

    Mean of (a - b)^2 / (a + b) of all pixels that fired, a and b being their counts: 1 for a Poisson process, as
    noise is, less for a regular leak, far more where something moves or the light changes. events: one or more; size:
    (width, height).
    """
    width, height = size
    place = events.y.astype(np.int64) * width + events.x
    cut = int(np.searchsorted(events.t_us, (events.t_us[0] + events.t_us[-1]) / 2))
    first, second = (np.bincount(half, minlength=height * width) for half in (place[:cut], place[cut:]))
    fired = first + second > 0
    return float(np.mean((first - second)[fired] ** 2 / (first + second)[fired]))


def save_noise_map(path: str | Path, noise_map: np.ndarray) -> None:
    """Write rates of shape (2, height, width), events/s, as .npz, atomically. Raises DataError, StorageError."""
    check_noise_suffix(path)
    buffer = io.BytesIO()
    np.savez_compressed(buffer, noise_map=noise_map)
    atomic.write_bytes(Path(path), buffer.getvalue())


def load_noise_map(path: str | Path) -> np.ndarray:
    """Rates that `save_noise_map` wrote, float64 of shape (2, height, width). Raises DataError."""
    check_noise_suffix(path)
    if not Path(path).is_file():
        raise DataError(f"{path}: there is no such file")
    try:
        with npz.archive(Path(path)) as archive:
            noise_map = npz.numbers(archive, "noise_map", Path(path), MOST_BYTES)
    except (DataError, ValueError, KeyError) as error:
        reason = " ".join(str(error).split())[:160]
        raise DataError(f"{path}: not a noise map made by `evslip calibrate` ({reason})") from None
    if noise_map.ndim != 3 or len(noise_map) != 2:
        raise DataError(f"{path}: the noise map's shape is {noise_map.shape}, expected (2, height, width)")
    return noise_map


def check_noise_suffix(path: str | Path) -> None:
    """Raise DataError unless the file is named as a noise map is."""
    if Path(path).suffix.lower() != ".npz":
        raise DataError(f"{path}: a noise map is an .npz file; its name must end in .npz")
