"""Binning and training step against their plain dense forms: python benchmarks/learn.py [WINDOWS.h5] [--batch 16]

Without a file: windows of random edges, about as dense as simulated ones (40,000 events).
"""

import argparse
import time
from collections.abc import Callable

import numpy as np
import torch
from torch.nn import functional

from evslip.learn import build_model
from evslip.learn.sparse_conv import dense
from evslip.window_set import WindowEvents, load_windows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("windows", nargs="?")
    parser.add_argument("--batch", type=int, default=16)
    options = parser.parse_args()
    windows = [made_up(seed) for seed in range(options.batch)]
    if options.windows:
        stored = load_windows(options.windows)
        windows = [stored[i] for i in range(min(options.batch, len(stored)))]
    events = np.mean([len(window.t_us) for window in windows])
    print(f"{len(windows)} windows of {events:,.0f} events on average, {torch.get_num_threads()} threads")

    network = build_model("cnn3d_bn")
    binned = median_ms(lambda: [network.prepare(window) for window in windows]) / len(windows)
    plain = median_ms(lambda: [by_numpy(window) for window in windows[:4]], 3) / len(windows[:4])
    row("binning and pooling, a window", binned, plain)

    batch = [network.prepare(window) for window in windows]
    labels = torch.arange(len(batch)) % 2

    def step(forward: Callable[[], torch.Tensor]) -> Callable[[], None]:
        return lambda: functional.cross_entropy(forward(), labels).backward()

    row("training step from coordinates", median_ms(step(lambda: network(batch))), median_ms(step(densely(batch)), 3))


def densely(batch: list) -> Callable[[], torch.Tensor]:
    """The same network with its first layer dense, on ready-made grids."""
    network = build_model("cnn3d_bn")
    grids = dense(batch, network.grid)  # type: ignore[arg-type]
    rest = torch.nn.Sequential(
        *(network.get_submodule(name) for name in ("conv1", "norm1")), torch.nn.ReLU(),
        *(network.get_submodule(name) for name in ("conv2", "norm2")), torch.nn.ReLU(),
        *(network.get_submodule(name) for name in ("conv3", "norm3")), torch.nn.ReLU(),
        torch.nn.Flatten(), network.get_submodule("head"),
    )  # fmt: skip
    return lambda: rest(grids)


def made_up(seed: int, count: int = 40_000) -> WindowEvents:
    """Events of 400 points that drift through the crop."""
    rng = np.random.default_rng(seed)
    point, t_us = rng.integers(0, 400, count), np.sort(rng.integers(0, 160_000, count))
    start, speed = rng.uniform(0, [200, 250], (400, 2)), rng.normal(0, 150, 2)
    place = (start[point] + speed * t_us[:, None] / 1e6 + rng.normal(0, 0.7, (count, 2))) % [200, 250]
    x, y = place.astype(np.uint8).T
    return WindowEvents(t_us.astype(np.uint32), np.minimum(x, 199), np.minimum(y, 249), rng.random(count) < 0.5)


def by_numpy(window: WindowEvents) -> torch.Tensor:
    """Binary occupancy by indexing, then average pooling."""
    grid = torch.zeros(2, 350, 250, 200)
    rows_columns = window.y.astype(np.int64), window.x.astype(np.int64)
    grid[np.where(window.p, 0, 1), window.t_us.astype(np.int64) * 350 // 160_000, *rows_columns] = 1
    return functional.avg_pool2d(grid, 4, 4, padding=1)


def median_ms(work: Callable[[], object], repeats: int = 10) -> float:
    """Median wall time of a call in milliseconds, after one to warm up."""
    work()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return 1e3 * float(np.median(times))


def row(name: str, ours_ms: float, plain_ms: float) -> None:
    print(f"{name:32} {ours_ms:9.2f} ms   dense {plain_ms:9.2f} ms   {plain_ms / ours_ms:6.1f} x")


if __name__ == "__main__":
    main()
