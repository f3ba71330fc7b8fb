"""The sparse convolution of any shape, which axis is time, and that every weight is trained."""

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch.nn import functional

from evslip.learn import NETWORKS, build_model
from evslip.learn.layers.occupancy import Occupancy, dense
from evslip.learn.layers.sparse_conv import sparse_conv3d
from evslip.learn.networks.cnn3d import CNN3d
from evslip.learn.networks.speed_network import SpeedNetwork
from evslip.windows.window_set import WindowEvents
from learn_windows import LENGTH_US, random_window


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


@given(
    st.tuples(st.integers(1, 6), st.integers(1, 6), st.sampled_from([1, 5])),
    st.tuples(st.integers(1, 4), st.integers(1, 4), st.sampled_from([2, 3])),
    st.tuples(*[st.integers(0, 9)] * 3),
    st.integers(0, 999),
)
@settings(max_examples=30)
def test_sparse_convolution_of_any_kernel_and_stride(kernel, stride, surplus, seed: int) -> None:
    grid = tuple(k + s for k, s in zip(kernel, surplus, strict=True))
    rng = np.random.default_rng(seed)
    cells = np.flatnonzero(rng.random(2 * int(np.prod(grid))) < 0.3)
    batch = [Occupancy(cells, rng.random(len(cells)).astype(np.float32))]
    weight = torch.from_numpy(rng.normal(size=(3, 2, *kernel)).astype(np.float32))
    expected = functional.conv3d(dense(batch, grid), weight, None, stride)
    torch.testing.assert_close(sparse_conv3d(batch, weight, None, grid, stride), expected, atol=1e-5, rtol=1e-5)


def test_a_pattern_moved_in_time_moves_along_the_time_axis() -> None:
    """The public code views (B, C, H, W, T) as (B, C, T, H, W): there, time is scrambled over rows and columns."""
    network = CNN3d()
    early = random_window(0, 2000)
    early = early.replace(t_us=np.sort(early.t_us % 40_000).astype(np.uint32))
    late = early.replace(t_us=(early.t_us + 16_000).astype(np.uint32))  # 16 ms: 35 bins, 7 strides
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
def test_every_parameter_of_every_network_is_trained(name: str) -> None:
    torch.manual_seed(0)
    network = build_model(name)
    batch = [network.prepare(random_window(k, 20_000)) for k in range(2)]
    speeds = [torch.tensor([[0.0, 0.0], [30.0, 8.0]])] if isinstance(network, SpeedNetwork) else []
    loss, logits = network.step(batch, torch.tensor([0, 1]), 0.0, *speeds)
    assert logits.shape == (2, 2) and loss.shape == ()
    if loss.requires_grad:
        loss.backward()
    for parameter in network.parameters():
        assert parameter.grad is not None and parameter.grad.abs().sum() > 0
