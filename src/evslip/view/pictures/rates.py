"""The rate of a stream of events over time."""

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from evslip.events.overlay import OFF_COLOR, ON_COLOR
from evslip.events.stream import SIGNAL, Events
from evslip.utils import atomic
from evslip.utils.errors import ConfigError
from evslip.view.pictures.images import figure_png

KINDS = ("ON", "OFF", "noise")
_BINS = 2048


def check_plot(path: Path) -> None:
    """Raise ConfigError unless a plot can be written to a file of this name."""
    if path.suffix.lower() != ".png":
        raise ConfigError(f"plot: {path}: the plot is a PNG; its name must end in .png")


@contextlib.contextmanager
def rates_plot(path: Path, title: str, start_us: float) -> Iterator[Callable[[Events, float], None]]:
    """Yields what takes events piece by piece, and the time up to which there are no others; the plot appears when the
    block ends. Raises ConfigError, StorageError."""
    check_plot(path)
    rates = Rates(start_us)
    with atomic.staged(path) as drawing:
        yield rates.push
        atomic.write_into(drawing, rates.png(f"{title}: {rates.count:,} events"), path)


class Rates:
    """Counts events in bins of time. Their number stays below a limit: when time goes on, they become twice as long."""

    def __init__(self, start_us: float):
        self.start_us = start_us
        self.bin_us = 1000.0
        self._counts = np.zeros((len(KINDS), _BINS), np.int64)
        self._end_us = start_us
        self.count = 0
        """Events so far."""

    def push(self, events: Events, until_us: float = -np.inf) -> None:
        """The next events, in time order, and a time up to which there are no others."""
        last_us = float(events.t_us[-1]) if events.count else self.start_us
        self._end_us, self.count = max(self._end_us, until_us, last_us), self.count + events.count
        while last_us - self.start_us >= (most_us := _BINS * self.bin_us) or self._end_us - self.start_us > most_us:
            halved = self._counts.reshape(len(KINDS), -1, 2).sum(axis=2)
            self._counts = np.concatenate([halved, np.zeros_like(halved)], axis=1)
            self.bin_us *= 2
        bins = ((events.t_us - self.start_us) // self.bin_us).astype(np.int64)
        noise = np.zeros(events.count, bool) if events.cause is None else events.cause != SIGNAL
        for counts, chosen in zip(self._counts, (events.p, ~events.p, noise), strict=True):
            counts += np.bincount(bins[chosen], minlength=_BINS)

    def per_second(self) -> tuple[np.ndarray, np.ndarray]:
        """Middles of the bins in seconds, (n,), and events a second of each of KINDS, (3, n), up to the last event or
        the time that was said. Noise is counted under its polarity too."""
        # The last bin is shorter: what is left of the time.
        edges = np.append(np.arange(0.0, self._end_us - self.start_us, self.bin_us), self._end_us - self.start_us)
        lengths_s = np.maximum(np.diff(edges), 1.0) / 1e6
        middles_s = (self.start_us + 0.5 * (edges[:-1] + edges[1:])) / 1e6
        return middles_s, self._counts[:, : len(lengths_s)] / lengths_s

    def png(self, title: str) -> bytes:
        """A plot of the rates: ON up, OFF down, noise as a line."""
        from matplotlib.figure import Figure

        t_s, (on, off, noise) = self.per_second()
        figure = Figure(figsize=(10, 3.8), layout="constrained")
        axes = figure.subplots()
        on_color, off_color = (tuple(c / 255 for c in color) for color in (ON_COLOR, OFF_COLOR))
        axes.fill_between(t_s, on / 1e3, color=on_color, alpha=0.75, lw=0, step="mid", label="ON")
        axes.fill_between(t_s, -off / 1e3, color=off_color, alpha=0.75, lw=0, step="mid", label="OFF, downwards")
        axes.step(t_s, noise / 1e3, color="0.15", lw=0.9, where="mid", label="noise of both")
        axes.axhline(0, color="0.3", lw=0.8)
        axes.yaxis.set_major_formatter(lambda value, _: f"{abs(value):g}")
        axes.set(xlabel="time in s", ylabel="1000 events/s")
        axes.set_title(title, loc="left")
        if len(t_s) > 1:
            axes.set_xlim(t_s[0], t_s[-1])
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, frameon=False)
        return figure_png(figure, dpi=110)
