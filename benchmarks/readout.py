"""What the readout does: to events of a given rate, and beside recordings of real sensors.

python benchmarks/readout.py load [--figure FILE.png]      events offered, read, delayed and lost, and the time it takes
python benchmarks/readout.py recording FILE.aedat4         event frames: clock, scan and counts, real and simulated
python benchmarks/readout.py rows FILE.raw                 rows a microsecond of a busy arbiter, real and simulated

`recording` and `rows` are for recordings of a DVXplorer Lite and of a Prophesee sensor.
"""

import argparse
import time
from pathlib import Path
from typing import Any

import numpy as np

from evslip.codecs import read_events
from evslip.events import EventCamera, Events, concatenate
from evslip.events.readout.sensor_readout import SensorReadout
from evslip.events.readout.settings import OFF, with_changes
from evslip.events.stream import SIGNAL

SIZE = (346, 260)
RATES_HZ = (1e5, 1e6, 3e6, 6e6, 1e7, 2e7, 5e7)
KINDS: dict[str, dict[str, float]] = {
    "bus, 12 M/s, 1024 places": {"bus_rate_hz": 12e6, "buffer_events": 1024},
    "arbiter, 0.185 us a row": {"row_us": 0.185},
    "event frames, 197 us": {"frame_us": 197.28, "scan_us": -192.0},
}
ROW_US = 0.185


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("verb", choices=("load", "recording", "rows"))
    parser.add_argument("file", type=Path, nargs="?")
    parser.add_argument("--figure", type=Path)
    options = parser.parse_args()
    if options.verb == "load":
        load(options.figure)
    elif options.file is None:
        parser.error(f"{options.verb}: needs a recording")
    elif options.verb == "recording":
        recording(options.file)
    else:
        rows(options.file)


def random_events(rate_hz: float, count: int, size: tuple[int, int] = SIZE, seed: int = 0) -> Events:
    """Events of all pixels alike, as a Poisson process makes them."""
    rng = np.random.default_rng(seed)
    t_us = np.cumsum(rng.exponential(1e6 / rate_hz, count)).astype(np.int64)
    x, y = (rng.integers(0, length, count).astype(np.uint16) for length in size)
    return Events(t_us, x, y, rng.random(count) < 0.5, None, np.full(count, SIGNAL, np.uint8))


def read(events: Events, size: tuple[int, int], **parameters: Any) -> tuple[Events, SensorReadout]:
    readout = SensorReadout(with_changes(OFF, parameters), (size[1], size[0]), 0)
    readout.begin(0.0)
    return readout.read(events, int(events.t_us[-1])), readout


def load(figure: Path | None) -> None:
    """Tables of what is read, delayed and lost at each rate offered, and the cost of an event."""
    found: dict[str, list[tuple[float, ...]]] = {kind: [] for kind in KINDS}
    print("| readout | offered, M/s | read, M/s | lost | mean delay, us | largest, us | ns an event |")
    print("|---|---|---|---|---|---|---|")
    for kind, parameters in KINDS.items():
        read(random_events(1e6, 1000), SIZE, **parameters)  # compiles
        for rate_hz in RATES_HZ:
            events = random_events(rate_hz, 1_000_000)
            start = time.process_time()
            _, readout = read(events, SIZE, **parameters)
            cost_ns = 1e9 * (time.process_time() - start) / events.count
            counts, seconds = readout.counts, 1e-6 * float(events.t_us[-1])
            read_hz, lost = sum(counts.read) / seconds, counts.lost / events.count
            found[kind].append((rate_hz, read_hz, lost, counts.mean_delay_us, counts.largest_delay_us))
            print(
                f"| {kind} | {rate_hz / 1e6:g} | {read_hz / 1e6:.2f} | {lost:.1%} | {counts.mean_delay_us:.2f} "
                f"| {counts.largest_delay_us} | {cost_ns:.0f} |"
            )
    if figure is not None:
        _plot(found, figure)


def _plot(found: dict[str, list[tuple[float, ...]]], figure: Path) -> None:
    import matplotlib.pyplot as plt

    _, axes = plt.subplots(1, 3, figsize=(12, 3.6), layout="constrained")
    for kind, rows in found.items():
        columns = np.array(rows).T
        for axis, values in zip(axes, (columns[1] / 1e6, 100 * columns[2], columns[3]), strict=True):
            axis.plot(columns[0] / 1e6, values, marker="o", label=kind)
    for axis, title in zip(axes, ("read, million events/s", "lost, %", "mean delay, us"), strict=True):
        axis.set(title=title, xlabel="offered, million events/s", xscale="log")
        axis.grid(alpha=0.3)
    axes[0].set_yscale("log")
    axes[0].plot(np.array(RATES_HZ) / 1e6, np.array(RATES_HZ) / 1e6, color="0.7", zorder=0)
    axes[2].set(yscale="log", ylim=(1e-2, 1e3))
    axes[0].legend(fontsize=8)
    plt.savefig(figure, dpi=110)


def recording(path: Path) -> None:
    """A table of the event frames of a recording, and of those of preset dvxplorer-lite at about its rate of events."""
    real = read_events(path)
    size = (320, 240)
    simulated = stripes(size, real.count / 76_800 / (1e-6 * float(np.ptp(real.t_us))), 1e-6 * float(np.ptp(real.t_us)))
    facts = [frame_facts(events, size) for events in (real, simulated)]
    print("| | recording | simulated |\n|---|---|---|")
    for name in facts[0]:
        print(f"| {name} | {facts[0][name]} | {facts[1][name]} |")


def stripes(size: tuple[int, int], rate_hz: float, seconds: float) -> Events:
    """Events of drifting stripes, each pixel firing about so often a second, seen by preset dvxplorer-lite."""
    y, x = np.mgrid[: size[1], : size[0]]
    camera = EventCamera("dvxplorer-lite", size=size)
    contrast, period = 2.0, 24.0  # ln units from stripe to stripe, of so many pixels
    # Pixels a microsecond; at a turn of the light an event is missing.
    speed = rate_hz * period / (2 * (contrast / camera.model.theta - 1)) * 1e-6

    def image(t_us: float) -> np.ndarray:
        phase = 2 * np.pi * (x + 0.3 * y + 4 * np.sin(y / 9) - speed * t_us) / period
        return np.exp(contrast / 2 * (np.tanh(4 * np.sin(phase)) - 1)).astype(np.float32)

    times_us = np.arange(0.0, 1e6 * seconds, min(0.25 / speed, 5000.0))
    return concatenate([camera.run((t, image(t)) for t in times_us), camera.waiting()])


def frame_facts(events: Events, size: tuple[int, int]) -> dict[str, str]:
    """Clock, scan and counts of event frames, found from the events alone."""
    t_us, x = (events.t_us - events.t_us[0]).astype(float), events.x.astype(np.int64)
    pixel = events.y.astype(np.int64) * size[0] + x
    order = np.lexsort((t_us, pixel))
    gaps = np.diff(t_us[order])[np.diff(pixel[order]) == 0]

    def phases(frame_us: float) -> np.ndarray:
        turns = np.exp(2j * np.pi * t_us / frame_us)
        return np.bincount(x, turns.real, size[0]) + 1j * np.bincount(x, turns.imag, size[0])

    # The period at which all events of a column have one phase.
    candidates = np.arange(197.0, 197.6, 0.002)
    frame_us = float(candidates[np.argmax([np.abs(phases(candidate)).sum() for candidate in candidates])])
    sums = phases(frame_us)
    coherence = np.abs(sums).sum() / events.count
    busy = np.bincount(x, minlength=size[0]) > 20
    phase_us = np.unwrap(np.angle(sums[busy])) / (2 * np.pi) * frame_us
    slope, start = np.polyfit(np.flatnonzero(busy), phase_us, 1)
    frame = np.round((t_us - (start + slope * x)) / frame_us).astype(np.int64)
    column = frame * size[0] + x
    each, counts = np.unique(column, return_counts=True)
    ends = np.lexsort((t_us, column))
    spread = np.maximum.reduceat(t_us[ends], np.searchsorted(column[ends], each))
    spread = spread - np.minimum.reduceat(t_us[ends], np.searchsorted(column[ends], each))
    per_frame = events.count / (frame.max() - frame.min() + 1)
    return {
        "events a second, thousands": f"{1e3 * events.count / t_us[-1]:.0f}",
        "time from frame to frame, us": f"{frame_us:.2f}",
        "events that agree with this clock, by phase": f"{100 * coherence:.2f} %",
        "time from a column to the next, us": f"{slope:.3f}",
        "columns scanned within, us": f"{abs(slope) * size[0]:.1f}",
        "columns with events of different time stamps": f"{np.count_nonzero(spread):,} of {len(each):,}",
        "pixels with two events in a frame": f"{events.count - len(np.unique(column * size[1] + events.y)):,}",
        "shortest interval at a pixel, us": f"{gaps.min():.0f}",
        "events a frame": f"{per_frame:.1f}",
        "events a column that has any": f"{counts.mean():.2f}, at most {counts.max()}",
    }


def rows(path: Path) -> None:
    """How many rows are read in a microsecond while an arbiter is busy, in a recording and simulated."""
    real = read_events(path)
    window = 50
    real_rows, real_events = _rows_a_microsecond(real)
    whole = len(real_rows) // window * window
    busy = np.repeat(real_rows[:whole].reshape(-1, window).mean(1) > 5, window)
    rate_hz = 1e6 * float(real_events[:whole][busy].mean())
    made, _ = read(random_events(rate_hz, 1_000_000, (640, 480)), (640, 480), row_us=ROW_US)
    made_rows, made_events = _rows_a_microsecond(made)
    print(
        "| rows read in a busy microsecond | mean | 0 | 1 | 2 | 3 | 4 | 5 | 6 | 7 | events a row |\n"
        + "|---" * 11
        + "|"
    )
    for name, count, number in (
        ("recording", real_rows[:whole][busy], real_events[:whole][busy]),
        (f"row_us = {ROW_US}", made_rows[1000:], made_events[1000:]),
    ):
        shares = " | ".join(f"{share:.1%}" for share in np.bincount(count, minlength=8)[:8] / len(count))
        print(f"| {name} | {count.mean():.2f} | {shares} | {number.sum() / count.sum():.2f} |")


def _rows_a_microsecond(events: Events) -> tuple[np.ndarray, np.ndarray]:
    """Rows and events with each time stamp."""
    t_us, y = events.t_us - events.t_us[0], events.y.astype(np.int64)
    first = np.concatenate([[True], (np.diff(t_us) != 0) | (np.diff(y) != 0)])
    return np.bincount(t_us[first]), np.bincount(t_us)


if __name__ == "__main__":
    main()
