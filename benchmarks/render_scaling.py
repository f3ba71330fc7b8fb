"""How the fast renderer's cost grows with the image and shrinks with threads: python benchmarks/render_scaling.py

Draws --frames frames, evenly spread over the recorded spans of --count random samples, at several sizes: processor time
a frame on one thread. Then as many frames a second of the clock on the wall as one process draws with one thread and
with more, each thread with a renderer and samples of its own; other work on the machine lowers these. --out draws the
plot.
"""

import argparse
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.physics.simulation import simulate
from evslip.physics.trajectory import Trajectory
from evslip.physics.truth import measure
from evslip.rendering import render

SIZES = ((173, 130), (346, 260), (640, 480), (1280, 720))


def spend(traj: Trajectory, size: tuple[int, int], frames: int) -> tuple[float, float]:
    """Seconds of processor and of wall that a sample's frames take, without its preparation."""
    times = np.linspace(*measure(traj).span_us, frames + 1).astype(np.int64)
    images = render(traj, size=size, times_us=times)
    next(images)
    processor, wall = time.process_time(), time.perf_counter()
    for _ in images:
        pass
    return time.process_time() - processor, time.perf_counter() - wall


def rate(trajectories: list[Trajectory], size: tuple[int, int], frames: int, threads: int) -> float:
    """Frames a second that so many threads draw together."""
    with ThreadPoolExecutor(threads) as pool:
        jobs = [trajectories[k % len(trajectories)] for k in range(threads)]
        seconds = [wall for _, wall in pool.map(lambda traj: spend(traj, size, frames), jobs)]
    return threads * frames / max(seconds)


def plot(out: Path, milliseconds: list[float], rates: dict[int, float]) -> None:
    import matplotlib.pyplot as plt

    plt.rcParams |= {"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "lines.linewidth": 1.5}
    figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3.2), layout="constrained", width_ratios=(2, 1))
    megapixels = np.array([width * height for width, height in SIZES]) / 1e6
    left.loglog(megapixels, milliseconds, "o-", color="#1f4e79")
    left.loglog(megapixels, milliseconds[1] / megapixels[1] * megapixels, "--", color="#9a9a9a", label="as the pixels")
    for (width, height), x, y in zip(SIZES, megapixels, milliseconds, strict=True):
        left.annotate(f"{width} x {height}", (x, y), textcoords="offset points", xytext=(6, -12))
    left.set(xlabel="pixels, millions", ylabel="processor time a frame, ms", xlim=(0.015, 3), ylim=(1.5, 100))
    left.set_xticks([0.02, 0.1, 0.5, 2], ["0.02", "0.1", "0.5", "2"])
    left.set_yticks([2, 5, 10, 20, 50, 100], ["2", "5", "10", "20", "50", "100"])
    left.minorticks_off()
    left.legend(frameon=False)
    right.bar([str(threads) for threads in rates], list(rates.values()), color="#1f4e79", width=0.6)
    right.set(xlabel="threads", ylabel="frames a second, 346 x 260")
    figure.savefig(out, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=2, help="samples")
    parser.add_argument("--frames", type=int, default=60, help="frames a sample")
    parser.add_argument("--threads", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--out", type=Path, help="such as docs/figures/render_scaling.png")
    options = parser.parse_args()
    trajectories = [simulate(draw(load_config("complex"), index)) for index in range(options.count)]
    spend(trajectories[0], SIZES[0], 1)  # compiles when the cache is cold
    print("| size | CPU-ms a frame | ns a pixel |")
    print("|---|---|---|")
    milliseconds = []
    for width, height in SIZES:
        seconds = sum(spend(traj, (width, height), options.frames)[0] for traj in trajectories)
        milliseconds.append(1e3 * seconds / options.frames / options.count)
        print(f"| {width} x {height} | {milliseconds[-1]:.1f} | {1e6 * milliseconds[-1] / width / height:.0f} |")
    rates = {threads: rate(trajectories, (346, 260), options.frames, threads) for threads in options.threads}
    for threads, speed in rates.items():
        print(f"{threads} threads: {speed:.0f} frames a second of wall time at 346 x 260")
    if options.out:
        plot(options.out, milliseconds, rates)


if __name__ == "__main__":
    main()
