"""Times of frames, from a file or from a rate."""

import re
from pathlib import Path

import numpy as np

from evslip.utils.errors import ConfigError, DataError
from evslip.utils.files import require_file

UNITS = {"us": 1.0, "s": 1e6}
"""Microseconds in each unit that times may be given in."""
_HEADERS = {"us": ("t_us", "time_us", "timestamp_us", "us"), "s": ("t_s", "time_s", "timestamp_s", "s")}
_SEPARATORS = re.compile(r"[,;\s]+")


def check_fps(fps: float) -> None:
    """Raise ConfigError unless frames can come at this rate, in frames a second."""
    if not 0 < fps <= 1e6:
        raise ConfigError(f"fps: {fps!r} is out of range, expected more than 0 and at most 1000000 frames a second")


def read_times(path: str | Path, unit: str | None = None) -> np.ndarray:
    """Times of frames in microseconds, float64 of shape (n,), from a text file with one frame a line.

    The first column counts; commas, semicolons or blanks separate it from others, which are ignored. A first line may
    name it: t_us or t_s. `unit`, "us" or "s", overrides that; without either it is microseconds. Empty lines and
    lines that begin with # are skipped. Raises DataError, ConfigError.
    """
    if unit is not None and unit not in UNITS:
        raise ConfigError(f"times-unit: {unit!r} is unknown; expected one of {', '.join(UNITS)}")
    named: str | None = None
    values: list[float] = []
    try:
        lines = require_file(path).read_text(encoding="utf-8-sig").splitlines()
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: not a text file of times: {error}") from None
    for number, line in enumerate(lines, 1):
        first = _SEPARATORS.split(line.strip())[0]
        if not first or first.startswith("#"):
            continue
        try:
            values.append(float(first))
        except ValueError:
            found = [unit for unit, names in _HEADERS.items() if first.lower().strip('"') in names]
            if values or named or not found:
                raise DataError(
                    f"{path}: line {number} begins with {first[:40]!r}, expected a time, or a header t_us or t_s"
                ) from None
            named = found[0]
    times_us = UNITS[unit or named or "us"] * np.array(values, np.float64)
    check_increasing(times_us, path)
    hint = "; are they seconds? Then head the column t_s" if not (unit or named) else ""
    if len(times_us) > 1 and np.median(np.diff(times_us)) < 1.0:
        raise DataError(f"{path}: the frames come less than a microsecond apart{hint}")
    return times_us


def check_increasing(times_us: np.ndarray, where: object) -> None:
    """Raise DataError unless there are times, all finite, each later than the one before."""
    if not len(times_us):
        raise DataError(f"{where}: holds no times")
    bad = np.flatnonzero(~np.isfinite(times_us))
    if bad.size:
        raise DataError(f"{where}: the time of frame {bad[0]} is {times_us[bad[0]]}, expected a finite number")
    bad = np.flatnonzero(times_us[1:] <= times_us[:-1])
    if bad.size:
        i = int(bad[0])
        raise DataError(
            f"{where}: the time of frame {i + 1}, {times_us[i + 1]:.10g} us, does not come after that of frame {i}, "
            f"{times_us[i]:.10g} us"
        )


def check_count(times_us: np.ndarray, count: int, where: object) -> None:
    """Raise DataError unless every frame has its time."""
    if len(times_us) != count:
        raise DataError(f"{where}: {len(times_us)} times were given for {count} frames")
