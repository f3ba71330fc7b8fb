"""Observations: what of an episode's events and senses an agent gets, and in which arrays."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium import spaces

from evslip.control.senses import Senses
from evslip.events.stream import Events, concatenate
from evslip.learn.layers.grids import voxel_grid
from evslip.utils.errors import ConfigError
from evslip.windows.window_events import WindowEvents

SENSES_LOW = np.array([0, 0, 0, -100, -100, -100, -np.pi, 0], np.float32)
SENSES_HIGH = np.array([100, 100, 0.1, 100, 100, 100, np.pi, 100], np.float32)
"""Bounds of `Senses.vector`; what lies beyond is cut."""
MOST_COUNT, MOST_VOXEL = 255, 1000.0


@dataclass(frozen=True)
class Window:
    """Events of the last while, which an observation is made of."""

    size: tuple[int, int]
    """Width and height of the sensor."""
    length_us: int
    most_events: int = 20_000
    """Events that `events` has room for; of more, the newest are kept."""
    bins: int = 5
    """Points in time of `voxels`."""

    def until(self, events: Events, now_us: int) -> Events:
        """Those of some events that are in the window which ends now."""
        return events.between(now_us - self.length_us + 1, now_us + 1)

    def after(self, before: Events, new: Events, since_us: int, now_us: int) -> Events:
        """Events of the window that ends now: of the window before, and those that came since then.

        What comes late, as by a coarse clock or in light that flickers, may have an earlier time than the window
        begins: if the window is as long as the step, no other window has it, so it counts as of the begin.
        """
        oldest_us = now_us - self.length_us + 1
        if oldest_us <= since_us + 1:
            new = new.replace(t_us=np.maximum(new.t_us, oldest_us))
        return self.until(concatenate([before, new]), now_us)


Observe = Callable[[Events, Senses, int], Any]
"""From the events of a window, the senses and the time at which the window ends."""


def observed(name: str, window: Window) -> tuple[spaces.Space[Any], Observe]:
    """The space of an observation by its name, and what makes one. Raises ConfigError."""
    if not isinstance(name, str) or name not in OBSERVATIONS:
        raise ConfigError(f"obs: {name!r} is unknown; expected one of {', '.join(OBSERVATIONS)}")
    return OBSERVATIONS[name](window)


def _counts(window: Window) -> tuple[spaces.Space[Any], Observe]:
    width, height = window.size

    def observe(events: Events, senses: Senses, now_us: int) -> np.ndarray:
        place = (events.p == 0).astype(np.intp) * (width * height) + events.y.astype(np.intp) * width + events.x
        counts = np.bincount(place, minlength=2 * width * height)
        return np.minimum(counts, MOST_COUNT, out=counts).astype(np.uint8).reshape(2, height, width)

    return spaces.Box(0, MOST_COUNT, (2, height, width), np.uint8), observe


def _voxels(window: Window) -> tuple[spaces.Space[Any], Observe]:
    width, height = window.size

    def observe(events: Events, senses: Senses, now_us: int) -> np.ndarray:
        placed = WindowEvents.of(events, now_us - window.length_us)
        grid = voxel_grid(placed, window.size, window.length_us, window.bins, 1)
        return np.clip(grid, -MOST_VOXEL, MOST_VOXEL)

    return spaces.Box(-MOST_VOXEL, MOST_VOXEL, (window.bins, height, width), np.float32), observe


def _events(window: Window) -> tuple[spaces.Space[Any], Observe]:
    (width, height), most = window.size, window.most_events

    def column(high: int, kind: type) -> spaces.Box:
        return spaces.Box(0, high, (most,), kind)

    columns = {
        "t_us": column(window.length_us, np.int32),
        "x": column(width - 1, np.uint16),
        "y": column(height - 1, np.uint16),
        "p": column(1, np.uint8),
    }

    def observe(events: Events, senses: Senses, now_us: int) -> dict[str, np.ndarray]:
        kept = events.select(slice(max(0, events.count - most), None))
        values = {"t_us": kept.t_us - (now_us - window.length_us), "x": kept.x, "y": kept.y, "p": kept.p}
        found: dict[str, np.ndarray] = {"count": np.array([kept.count], np.int32)}
        for name, space in columns.items():
            padded = np.zeros(most, space.dtype)
            padded[: kept.count] = values[name]
            found[name] = padded
        return found

    return spaces.Dict({"count": spaces.Box(0, most, (1,), np.int32), **columns}), observe


def _state(window: Window) -> tuple[spaces.Space[Any], Observe]:
    def observe(events: Events, senses: Senses, now_us: int) -> np.ndarray:
        return np.clip(senses.vector(), SENSES_LOW, SENSES_HIGH)

    return spaces.Box(SENSES_LOW, SENSES_HIGH, dtype=np.float32), observe


def _combined(window: Window) -> tuple[spaces.Space[Any], Observe]:
    (counts, count), (state, sense) = _counts(window), _state(window)

    def observe(events: Events, senses: Senses, now_us: int) -> dict[str, np.ndarray]:
        return {"counts": count(events, senses, now_us), "state": sense(events, senses, now_us)}

    return spaces.Dict({"counts": counts, "state": state}), observe


OBSERVATIONS: dict[str, Callable[[Window], tuple[spaces.Space[Any], Observe]]] = {
    "events": _events,
    "counts": _counts,
    "voxels": _voxels,
    "state": _state,
    "combined": _combined,
}
"""Makers of a space and of what observes, by name."""
