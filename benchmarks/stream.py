"""Latency of a detector's answers on a stream: python benchmarks/stream.py [MODEL] [--rate 1e6] [--hop-ms 1] [--json F]

One core. Events of points that drift over the whole sensor (346 x 260) are pushed a hop at a time, as a camera would
hand them over; what is timed is each push: crop, binning, network. The goal is a decision every millisecond at a
million events a second: median and p99 of the wall time below 1 ms. Processor time is shown, too: it is what the wall
time would be if nothing else ran. Without a model: fresh weights of --network.
"""

import argparse
import cProfile
import json
import pstats
import tempfile
import time
from pathlib import Path

import numpy as np

from evslip.events.stream import Events
from evslip.learn import NETWORKS, Detector, build_model
from evslip.learn.checkpoint import Description, save_model
from evslip.learn.evaluation.cost import one_core
from evslip.windows.window_set import WindowSettings

SIZE = (346, 260)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model", nargs="?", type=Path)
    parser.add_argument("--network", default="cnn3d_bn", choices=list(NETWORKS))
    parser.add_argument("--rate", type=float, nargs="+", default=[1e5, 1e6], help="events a second of the whole sensor")
    parser.add_argument("--hop-ms", type=float, nargs="+", default=[1.0, 5.0])
    parser.add_argument("--count", type=int, default=300, help="hops that are timed")
    parser.add_argument("--profile", action="store_true")
    parser.add_argument("--json", type=Path, help="file for the figures")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, one_core():
        model = options.model or Path(folder)
        if options.model is None:
            network = build_model(options.network)
            save_model(model, network, Description(options.network, 0.5, WindowSettings(), {}))
        found = [
            measure(model, rate, hop_ms, options.count, options.profile)
            for rate in options.rate
            for hop_ms in options.hop_ms
        ]
    if options.json:
        options.json.write_text(json.dumps(found, indent=1) + "\n")


def measure(model: Path, rate: float, hop_ms: float, count: int, profile: bool) -> dict[str, float]:
    """Push hop after hop; print and return the latencies."""
    detector = Detector(model, size=SIZE, hop_s=hop_ms / 1e3)
    window_hops = round(detector.description.windows.length_s * 1e3 / hop_ms)
    warm_up = 2 * window_hops  # the buffers are full
    events = drifting(rate, (warm_up + count + 1) * hop_ms / 1e3)
    edges = np.searchsorted(events.t_us, np.arange(warm_up + count + 1) * hop_ms * 1e3)
    times, work = [], []
    profiler = cProfile.Profile()
    for i in range(warm_up + count):
        piece = events.select(slice(edges[i], edges[i + 1]))
        if profile and i == warm_up:
            profiler.enable()
        start, began = time.perf_counter(), time.thread_time()
        detector.push(piece, until_us=round((i + 1) * hop_ms * 1e3))
        times.append(1e3 * (time.perf_counter() - start))
        work.append(1e3 * (time.thread_time() - began))
    profiler.disable()
    p50, p99 = np.quantile(times[warm_up:], (0.5, 0.99))
    work_p50, work_p99 = np.quantile(work[warm_up:], (0.5, 0.99))
    verdict = "keeps up" if p99 <= hop_ms else f"falls behind: {p99 / hop_ms:.1f} x too slow at p99"
    print(
        f"{rate / 1e6:5.2f} M events/s, hop {hop_ms:g} ms: p50 {p50:6.3f} ms, p99 {p99:6.3f} ms (processor "
        f"{work_p50:.3f}, {work_p99:.3f}); {1e3 / work_p50:,.0f} decisions a processor second; {verdict}",
        flush=True,
    )
    if profile:
        pstats.Stats(profiler).sort_stats("tottime").print_stats(14)
    return {
        "rate": rate,
        "hop_ms": hop_ms,
        "p50_ms": float(p50),
        "p99_ms": float(p99),
        "processor_p50_ms": float(work_p50),
        "processor_p99_ms": float(work_p99),
    }


def drifting(rate: float, seconds: float, points: int = 1000) -> Events:
    """Points that drift over the sensor and fire at random."""
    rng = np.random.default_rng(0)
    count = round(rate * seconds)
    t_us = np.sort(rng.integers(0, round(seconds * 1e6), count))
    which = rng.integers(0, points, count)
    start, speed = rng.uniform(0, SIZE, (points, 2)), rng.normal(0, 100, 2)
    place = (start[which] + speed * t_us[:, None] / 1e6 + rng.normal(0, 1, (count, 2))) % SIZE
    x, y = place.astype(np.uint16).T
    return Events(t_us, np.minimum(x, SIZE[0] - 1), np.minimum(y, SIZE[1] - 1), rng.random(count) < 0.5)


if __name__ == "__main__":
    main()
