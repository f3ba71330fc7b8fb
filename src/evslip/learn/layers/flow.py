"""How the picture moves, without learning: contrast maximisation and normal flow."""

from typing import NamedTuple

import numpy as np

from evslip.utils.jit import compiled
from evslip.windows.window_set import WindowEvents

MOST_EVENTS = 4000
"""Events of a window that are used; of more, every n-th is taken."""
SPEEDS_PX_S = np.linspace(-600, 600, 13)
CELL_PX = 2
RADIUS = 2
"""Pixels around an event in which a plane is fitted."""
MEMORY_US = 30_000
"""Older neighbours belong to another edge."""


@compiled()
def _variances(t_s, x, y, speeds, columns, rows, cell, out):
    """Variance of the picture of events carried back at each velocity (first index: vertical)."""
    picture = np.zeros((rows, columns))
    for i in range(len(speeds)):
        for j in range(len(speeds)):
            picture[:] = 0
            inside = 0
            for k in range(len(t_s)):
                column = np.int64(np.floor((x[k] - speeds[j] * t_s[k]) / cell))
                row = np.int64(np.floor((y[k] - speeds[i] * t_s[k]) / cell))
                if 0 <= row < rows and 0 <= column < columns:
                    picture[row, column] += 1
                    inside += 1
            squares = 0.0
            for row in range(rows):
                for column in range(columns):
                    squares += picture[row, column] ** 2
            number = rows * columns
            out[i, j] = squares / number - (inside / number) ** 2


@compiled()
def _planes(t_us, x, y, width, height, radius, memory_us, out):
    """Fit t = a x + b y + c to the newest neighbours of each event; write (a, b) in s/px. Returns how many fitted."""
    newest = np.full((height, width), -np.inf)
    number = 0
    for i in range(len(t_us)):
        newest[y[i], x[i]] = t_us[i]
        n, sx, sy, st, sxx, sxy, syy, sxt, syt = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for dy in range(-radius, radius + 1):
            for dx in range(-radius, radius + 1):
                row, column = np.int64(y[i]) + dy, np.int64(x[i]) + dx
                if row < 0 or row >= height or column < 0 or column >= width:
                    continue
                age = newest[row, column] - t_us[i]
                if age < -memory_us:
                    continue
                age *= 1e-6
                n += 1
                sx += dx
                sy += dy
                st += age
                sxx += dx * dx
                sxy += dx * dy
                syy += dy * dy
                sxt += dx * age
                syt += dy * age
        if n < 8:
            continue
        vx, vy, cov = sxx - sx * sx / n, syy - sy * sy / n, sxy - sx * sy / n
        tx, ty = sxt - sx * st / n, syt - sy * st / n
        determinant = vx * vy - cov * cov
        if determinant <= 1e-9:
            continue
        out[number, 0] = (tx * vy - ty * cov) / determinant
        out[number, 1] = (ty * vx - tx * cov) / determinant
        number += 1
    return number


class Motion(NamedTuple):
    """Motion of a window by contrast maximisation."""

    velocity_px_s: tuple[float, float]
    """Horizontal and vertical, of the grid's velocity that makes the sharpest picture."""
    gain: float
    """How much greater the picture's variance is than at rest, 1 or more."""


def sharpest(events: WindowEvents, size: tuple[int, int]) -> Motion:
    """The velocity, on a grid of 100 px/s, that makes the picture of the warped events most contrasty (Gallego et al.
    2018)."""
    few = thinned(events)
    if len(few.t_us) < 2:
        return Motion((0.0, 0.0), 1.0)
    out = np.empty((len(SPEEDS_PX_S), len(SPEEDS_PX_S)))
    x, y = few.x.astype(np.float64), few.y.astype(np.float64)
    rows, columns = -(-size[1] // CELL_PX), -(-size[0] // CELL_PX)
    _variances(few.t_us / 1e6, x, y, SPEEDS_PX_S, columns, rows, CELL_PX, out)
    i, j = np.unravel_index(out.argmax(), out.shape)
    still = out[len(SPEEDS_PX_S) // 2, len(SPEEDS_PX_S) // 2]
    gain = float(out[i, j] / still) if still > 0 else 1.0
    return Motion((float(SPEEDS_PX_S[j]), float(SPEEDS_PX_S[i])), gain)


def normal_flow(events: WindowEvents, size: tuple[int, int]) -> np.ndarray:
    """Velocities across edges in px/s, of shape (n, 2), from planes fitted to the times of neighbouring events
    (Benosman et al. 2014). Events without enough neighbours have none."""
    few = thinned(events, 4 * MOST_EVENTS)
    slopes = np.empty((len(few.t_us), 2))
    number = _planes(few.t_us.astype(np.float64), few.x, few.y, size[0], size[1], RADIUS, MEMORY_US, slopes)
    slopes = slopes[:number]
    return slopes / np.maximum((slopes**2).sum(1, keepdims=True), 1e-7)  # the floor is a speed of 3,000 px/s


def thinned(events: WindowEvents, most: int = MOST_EVENTS) -> WindowEvents:
    """At most so many events, evenly taken."""
    step = -(-len(events.t_us) // most) or 1
    return events[::step]
