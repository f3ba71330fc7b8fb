"""Training steps and binning against their plain dense forms: python benchmarks/learn.py [WINDOWS.h5] [--batch 32]

A step is the forward pass, the loss, the backward pass and the optimiser's update. The dense form is the same network
in plain PyTorch on grids that lie ready in memory; ours begins with the windows' occupied cells. Binning is compared
with numpy and, where it is installed, with tonic's ToFrame. Without a file: windows of drifting points, about as dense
as simulated ones (40,000 events). Names of networks choose some of them.
The time is the least of several; with --threads 1 it is processor time, which others on the machine hardly change.
"""

import argparse
import importlib.util
import time
from collections.abc import Callable, Sequence

import numba
import numpy as np
import torch
from torch.nn import functional

from evslip.learn import build_model
from evslip.learn.layers import patterns
from evslip.learn.layers.occupancy import Binner, dense
from evslip.learn.networks.cnn3d import CNN3d
from evslip.learn.networks.mlp import MLP
from evslip.learn.networks.snn import SNN
from evslip.windows.window_set import WindowEvents, open_windows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("windows", nargs="?")
    parser.add_argument("--batch", type=int, default=32)
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--threads", type=int)
    parser.add_argument("--networks", nargs="+", default=["mlp", "snn", "cnn3d", "cnn3d_bn"])
    options = parser.parse_args()
    if options.threads:
        torch.set_num_threads(options.threads)
        numba.set_num_threads(options.threads)
    windows = [made_up(seed) for seed in range(options.batch)]
    if options.windows:
        stored = open_windows(options.windows)
        order = np.random.default_rng(0).permutation(len(stored))[: options.batch]
        windows = [stored[int(i)] for i in order]
    events = np.mean([len(window.t_us) for window in windows])
    print(f"{len(windows)} windows of {events:,.0f} events on average, {torch.get_num_threads()} threads")
    binning(windows, options.repeats)
    for name in options.networks:
        training_step(name, windows, options.repeats)


def binning(windows: Sequence[WindowEvents], repeats: int) -> None:
    """Milliseconds a window to bin and pool."""
    for bins in (150, 350):
        binner = Binner(200, 250, 160_000, bins)
        ours = best_ms(lambda b=binner: each(b, windows), repeats) / len(windows)
        plain = best_ms(lambda n=bins: [by_numpy(window, n) for window in windows[:2]], 2) / 2
        row(f"binning, {bins} bins", ours, plain, "numpy")
        if importlib.util.find_spec("tonic"):
            frames = best_ms(by_tonic(windows[:8], bins), 3) / 8
            row(f"binning, {bins} bins", ours, frames, "tonic ToFrame")


def training_step(name: str, windows: Sequence[WindowEvents], repeats: int) -> None:
    """Milliseconds a step on the whole batch, from coordinates and dense."""
    torch.manual_seed(0)
    network = build_model(name)
    batch = [network.prepare(window) for window in windows]
    labels = torch.arange(len(batch)) % 2
    plain, ready = densely(network, batch)
    optimiser = torch.optim.AdamW(network.parameters(), lr=1e-5, fused=True)

    def step(loss: Callable[[], torch.Tensor]) -> Callable[[], None]:
        def run() -> None:
            optimiser.zero_grad()
            loss().backward()
            optimiser.step()

        return run

    ours = best_ms(step(lambda: network.step(batch, labels, 0.0)[0]), repeats)
    row(f"training step, {name}", ours, best_ms(step(lambda: plain(ready, labels)), max(2, repeats // 3)), "dense")


def densely(network: torch.nn.Module, batch: list) -> tuple[Callable[..., torch.Tensor], torch.Tensor]:
    """The loss of the same network with its first layer dense, of the snn all in plain torch, and the grids it begins
    with."""
    if isinstance(network, CNN3d):
        return lambda x, y: functional.cross_entropy(network.rest(network.conv1(x)), y), dense(batch, network.grid)
    if isinstance(network, MLP):
        return lambda x, y: functional.cross_entropy(network.dense(x), y), dense(batch, network.grid)
    assert isinstance(network, SNN)

    def loss(grids: torch.Tensor, labels: torch.Tensor) -> torch.Tensor:
        return network.loss(network.dense(grids), labels)

    return loss, patterns.dense(batch, network.input_neurons.units, network.grid[0])


def made_up(seed: int, count: int = 40_000) -> WindowEvents:
    """Events of 400 points that drift through the crop."""
    rng = np.random.default_rng(seed)
    point, t_us = rng.integers(0, 400, count), np.sort(rng.integers(0, 160_000, count))
    start, speed = rng.uniform(0, [200, 250], (400, 2)), rng.normal(0, 150, 2)
    place = (start[point] + speed * t_us[:, None] / 1e6 + rng.normal(0, 0.7, (count, 2))) % [200, 250]
    x, y = place.astype(np.uint8).T
    return WindowEvents(t_us.astype(np.uint32), np.minimum(x, 199), np.minimum(y, 249), rng.random(count) < 0.5)


def by_numpy(window: WindowEvents, bins: int) -> torch.Tensor:
    """Binary occupancy by indexing, then average pooling."""
    grid = torch.zeros(2, bins, 250, 200)
    rows_columns = window.y.astype(np.int64), window.x.astype(np.int64)
    grid[np.where(window.p, 0, 1), window.t_us.astype(np.int64) * bins // 160_000, *rows_columns] = 1
    return functional.avg_pool2d(grid, 4, 4, padding=1)


def by_tonic(windows: Sequence[WindowEvents], bins: int) -> Callable[[], object]:
    """tonic's frames of the same bins, without pooling."""
    from tonic.transforms import ToFrame  # pyright: ignore[reportMissingImports]

    transform = ToFrame(sensor_size=(200, 250, 2), n_time_bins=bins)
    events = [window.to_structured() for window in windows]

    def run() -> None:
        for sample in events:
            transform(sample)

    return run


def each(binner: Binner, windows: Sequence[WindowEvents]) -> None:
    """Bin every window; keep none, as training does not."""
    for window in windows:
        binner(*window.columns)


def best_ms(work: Callable[[], object], repeats: int) -> float:
    """Least time of a call in milliseconds, after one to warm up: others on the machine can only add to it."""
    clock = time.process_time if torch.get_num_threads() == 1 else time.perf_counter
    work()
    times = []
    for _ in range(repeats):
        start = clock()
        work()
        times.append(clock() - start)
    return 1e3 * min(times)


def row(name: str, ours_ms: float, plain_ms: float, plain: str) -> None:
    print(f"{name:26} {ours_ms:9.2f} ms   {plain:13} {plain_ms:9.2f} ms   {plain_ms / ours_ms:6.1f} x", flush=True)


if __name__ == "__main__":
    main()
