"""Binning and the sparse convolution against dense references; the paper's parameter counts; which axis is time."""

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch.nn import functional

from evslip.errors import ConfigError
from evslip.learn import NETWORKS, build_model
from evslip.learn.cnn3d import BINS, CNN3d
from evslip.learn.network import Geometry, Network
from evslip.learn.occupancy import Binner, Occupancy
from evslip.learn.sparse_conv import dense, sparse_conv3d
from evslip.window_set import WindowEvents

LENGTH_US = 160_000


def random_window(seed: int, count: int, width: int = 200, height: int = 250) -> WindowEvents:
    """Clustered in space and time, so that several events share a pixel and a bin."""
    rng = np.random.default_rng(seed)
    t_us = np.sort(rng.choice(rng.integers(0, LENGTH_US, max(1, count // 3)), count)).astype(np.uint32)
    x, y = (np.minimum(rng.beta(0.7, 0.7, count) * n, n - 1).astype(np.uint8) for n in (width, height))
    return WindowEvents(t_us, x, y, rng.random(count) < 0.5)


def brute_force(events: WindowEvents, bins: int, width: int = 200, height: int = 250) -> torch.Tensor:
    """Full-resolution occupancy (2, bins, rows, columns), then torch's average pooling."""
    grid = np.zeros((2, bins, height, width), np.float32)
    for t, x, y, p in zip(*events, strict=True):
        grid[0 if p else 1, int(t) * bins // LENGTH_US, y, x] = 1
    return functional.avg_pool3d(torch.from_numpy(grid)[None], (1, 4, 4), (1, 4, 4), (0, 1, 1))[0]


@given(st.integers(0, 2**32), st.integers(0, 3000), st.sampled_from([1, 10, 150]), st.booleans())
@settings(max_examples=15, deadline=None)
def test_binning_equals_occupancy_then_average_pooling(seed: int, count: int, bins: int, small: bool) -> None:
    width, height = (37, 30) if small else (200, 250)
    events = random_window(seed, count, width, height)
    binner = Binner(width, height, LENGTH_US, bins)
    binner(*random_window(seed + 1, 500, width, height))  # must leave nothing behind
    occupancy = binner(*events)
    expected = brute_force(events, bins, width, height)
    assert len(np.unique(occupancy.cells)) == len(occupancy.cells)
    torch.testing.assert_close(dense([occupancy], (bins, *expected.shape[2:]))[0], expected)


def test_the_paper_s_shape_and_both_ends_of_time() -> None:
    events = WindowEvents(
        np.array([0, LENGTH_US - 1], np.uint32),
        np.array([0, 198], np.uint8),
        np.array([0, 249], np.uint8),
        np.ones(2, bool),
    )
    network = CNN3d()
    grid = dense([network.prepare(events)], network.grid)[0]
    assert grid.shape == (2, 350, 63, 50)
    assert grid.nonzero().tolist() == [[0, 0, 0, 0], [0, 349, 62, 49]]


@pytest.mark.parametrize("seed", range(3))
def test_sparse_convolution_equals_the_dense_one_with_its_gradients(seed: int) -> None:
    network = CNN3d()
    batch = [network.prepare(random_window(seed + k, count)) for k, count in enumerate((4000, 0, 900))]
    layer = network.conv1
    assert layer.bias is not None
    out = sparse_conv3d(batch, layer.weight, layer.bias, network.grid, (5, 2, 2))
    signal = torch.randn(out.shape, generator=torch.Generator().manual_seed(seed))
    gradients = torch.autograd.grad((out * signal).sum(), [layer.weight, layer.bias])
    reference = layer(dense(batch, network.grid))
    expected = torch.autograd.grad((reference * signal).sum(), [layer.weight, layer.bias])
    torch.testing.assert_close(out, reference, atol=1e-5, rtol=1e-5)
    for one, other in zip(gradients, expected, strict=True):
        torch.testing.assert_close(one, other, atol=1e-3, rtol=1e-4)


@given(
    st.tuples(*[st.integers(1, 6)] * 3), st.tuples(*[st.integers(1, 4)] * 3), st.tuples(*[st.integers(0, 9)] * 3),
    st.integers(0, 999),
)  # fmt: skip
@settings(max_examples=30, deadline=None)
def test_sparse_convolution_of_any_kernel_and_stride(kernel, stride, surplus, seed: int) -> None:
    grid = tuple(k + s for k, s in zip(kernel, surplus, strict=True))
    rng = np.random.default_rng(seed)
    cells = np.flatnonzero(rng.random(2 * int(np.prod(grid))) < 0.3)
    batch = [Occupancy(cells, rng.random(len(cells)).astype(np.float32))]
    weight = torch.from_numpy(rng.normal(size=(3, 2, *kernel)).astype(np.float32))
    expected = functional.conv3d(dense(batch, grid), weight, None, stride)
    torch.testing.assert_close(sparse_conv3d(batch, weight, None, grid, stride), expected, atol=1e-5, rtol=1e-5)


def test_parameter_counts() -> None:
    def count(network: Network) -> int:
        return sum(p.numel() for p in network.parameters())

    assert count(build_model("cnn3d")) == 5696
    assert count(build_model("cnn3d_bn")) == 5696 + 2 * (2 + 4 + 8)


def test_a_pattern_moved_in_time_moves_along_the_time_axis() -> None:
    """The public code views (B, C, H, W, T) as (B, C, T, H, W): there, time is scrambled over rows and columns."""
    network = CNN3d()
    early = random_window(0, 2000)
    early = early._replace(t_us=np.sort(early.t_us % 40_000).astype(np.uint32))
    late = early._replace(t_us=(early.t_us + 16_000).astype(np.uint32))  # 16 ms: 35 bins, 7 strides
    one, other = dense([network.prepare(early)], network.grid)[0], dense([network.prepare(late)], network.grid)[0]
    torch.testing.assert_close(other[:, 35:], one[:, :-35])
    assert not other[:, :35].any()
    with torch.no_grad():
        first, second = (
            sparse_conv3d([network.prepare(events)], network.conv1.weight, None, network.grid, (5, 2, 2))
            for events in (early, late)
        )
    torch.testing.assert_close(second[:, :, 7:], first[:, :, :-7])


@pytest.mark.parametrize("name", NETWORKS)
def test_every_network_takes_any_batch_of_windows(name: str) -> None:
    torch.manual_seed(0)
    network = build_model(name).eval()
    batch = [network.prepare(random_window(k, count)) for k, count in enumerate((0, 1, 5000))]
    with torch.inference_mode():
        together = network(batch)
        torch.testing.assert_close(together, torch.cat([network([one]) for one in batch]))
    assert together.shape == (3, 2) and together.isfinite().all()


@pytest.mark.parametrize("name", NETWORKS)
def test_every_parameter_of_every_network_is_trained(name: str) -> None:
    torch.manual_seed(0)
    network = build_model(name)
    batch = [network.prepare(random_window(k, 20_000)) for k in range(2)]
    functional.cross_entropy(network(batch), torch.tensor([0, 1])).backward()
    for parameter in network.parameters():
        assert parameter.grad is not None and parameter.grad.abs().sum() > 0


def test_unknown_network() -> None:
    with pytest.raises(ConfigError, match=r"'resnet' is unknown; expected one of cnn3d, cnn3d_bn"):
        build_model("resnet")


def test_other_geometry() -> None:
    network = build_model("cnn3d_bn", Geometry(100, 120, 80_000))
    events = random_window(0, 1000, 100, 120)
    assert network([network.prepare(events._replace(t_us=events.t_us // 2))]).shape == (1, 2)
