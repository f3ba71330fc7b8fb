"""Layers that work on coordinates against the dense ones, and the spiking neurons against their definition."""

import math

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch.nn import functional

from evslip.learn import build_model
from evslip.learn.layers import patterns, srm
from evslip.learn.layers.grids import counts_in, voxel_grid
from evslip.learn.layers.input_neurons import POOL_WEIGHT, InputNeurons
from evslip.learn.layers.occupancy import Occupancy
from evslip.learn.layers.occupancy import dense as dense_grid
from evslip.learn.layers.pattern_linear import pattern_linear
from evslip.learn.layers.sparse_linear import sparse_linear
from evslip.learn.networks.mlp import MLP
from evslip.learn.networks.snn import SNN
from evslip.windows.window_events import WindowEvents
from learn_windows import random_window

GRID = (7, 3, 4)


def random_occupancy(seed: int, share: float = 0.2) -> Occupancy:
    rng = np.random.default_rng(seed)
    cells = np.flatnonzero(rng.random(2 * math.prod(GRID)) < share)
    by_time = cells[np.argsort(cells // 12 % 7, kind="stable")]
    return Occupancy(by_time, rng.random(len(cells)).astype(np.float32))


@given(st.integers(0, 10**6), st.sampled_from([1, 3, 8]))
@settings(max_examples=20)
def test_the_sparse_linear_layer_and_its_gradient_equal_the_dense_ones(seed: int, outputs: int) -> None:
    batch = [random_occupancy(seed + k, share) for k, share in enumerate((0.2, 0.0, 0.2))]
    weight = torch.randn(outputs, 24, generator=torch.Generator().manual_seed(seed), requires_grad=True)
    grids = dense_grid(batch, GRID).transpose(1, 2).flatten(2)
    sparse, full = sparse_linear(batch, weight, 7), grids @ weight.T
    assert (sparse - full).abs().max() < 1e-5
    towards = torch.randn_like(full)
    (one,), (other,) = (torch.autograd.grad((out * towards).sum(), weight) for out in (sparse, full))
    assert (one - other).abs().max() < 1e-5


def test_the_mlp_on_coordinates_equals_the_dense_one() -> None:
    torch.manual_seed(0)
    network = build_model("mlp")
    assert isinstance(network, MLP)
    batch = [network.prepare(random_window(seed, count)) for seed, count in enumerate((0, 3, 9000))]
    labels, grids = torch.tensor([0, 1, 1]), dense_grid(batch, network.grid)
    gradients = []
    for logits in (network(batch), network.dense(grids)):
        network.zero_grad()
        functional.cross_entropy(logits, labels).backward()
        gradients.append((logits.detach(), *(p.grad for p in network.parameters())))
    for one, other in zip(*gradients, strict=True):
        assert one is not None and other is not None
        assert (one - other).abs().max() < 1e-5


def test_the_snn_on_patterns_equals_the_dense_one() -> None:
    torch.manual_seed(0)
    network = build_model("snn")
    assert isinstance(network, SNN)
    with torch.no_grad():  # so that it spikes before it is trained
        network.linear1.weight += 0.3
        network.linear2.weight += 3
    batch = [network.prepare(random_window(seed, count)) for seed, count in enumerate((0, 3, 9000))]
    labels, grids = torch.tensor([0, 1, 1]), patterns.dense(batch, network.input_neurons.units, 150)
    gradients = []
    for spikes in (network.spikes(batch), network.dense(grids)):
        network.zero_grad()
        network.loss(spikes, labels).backward()
        gradients.append((spikes.detach(), network.linear1.weight.grad, network.linear2.weight.grad))
    for one, other in zip(*gradients, strict=True):
        assert one is not None and other is not None
        assert other.any() and (one - other).abs().max() < 1e-5 * other.abs().max()


@given(st.integers(0, 10**6), st.integers(1, 5), st.integers(1, 6), st.sampled_from([2, 3, 32]))
@settings(max_examples=20)
def test_the_linear_layer_of_patterns_and_its_gradient_equal_the_dense_ones(
    seed: int, rows: int, columns: int, outputs: int
) -> None:
    neurons, rng = InputNeurons((9, rows, columns)), np.random.default_rng(seed)
    cells = np.flatnonzero(rng.random(2 * 9 * rows * columns) < 0.3)
    batch = [neurons(Occupancy(some, np.full(len(some), 0.25, np.float32))) for some in (cells, cells[:0], cells[::2])]
    weight = torch.randn(outputs, 2 * rows * columns, generator=torch.Generator().manual_seed(seed), requires_grad=True)
    grids = patterns.dense(batch, neurons.units, 9)
    fast, full = pattern_linear(batch, weight, neurons.units, 9), grids @ weight.T
    assert (fast - full).abs().max() < 1e-5
    towards = torch.randn_like(full)
    (one,), (other,) = (torch.autograd.grad((out * towards).sum(), weight) for out in (fast, full))
    assert (one - other).abs().max() < 1e-5


@pytest.mark.parametrize(("name", "number"), [("mlp", 6_400_330), ("snn", 201_664), ("cnn3d", 5_696)])
def test_the_paper_counts_its_parameters(name: str, number: int) -> None:
    assert sum(p.numel() for p in build_model(name).parameters()) == number


def brute_spikes(drive: np.ndarray) -> np.ndarray:
    """Every response added up afresh in every bin."""
    spikes = np.zeros_like(drive)
    refractory = -srm.SCALE_REFRACTORY * srm.THETA * srm.alpha_kernel(srm.TAU_REFRACTORY, drive.shape[-1])
    for t in range(drive.shape[-1]):
        past = spikes[..., :t] @ refractory[t:0:-1]
        spikes[..., t] = drive[..., t] + past >= srm.THETA
    return spikes


def test_neurons_spike_as_their_responses_add_up() -> None:
    drive = np.random.default_rng(0).normal(3, 12, (6, 50))
    neurons, given_drive = srm.Srm(50), torch.from_numpy(drive).float()
    expected = brute_spikes(drive)
    assert 0.05 < expected.mean() < 0.5
    np.testing.assert_array_equal(neurons.spike(given_drive).numpy(), expected)


def test_a_layer_of_neurons_and_its_gradient_equal_those_of_plain_torch() -> None:
    summed = 6 * torch.randn(3, 60, 5, generator=torch.Generator().manual_seed(0))
    one, other = (summed.clone().requires_grad_() for _ in range(2))
    neurons, towards = srm.Srm(60), torch.randn(3, 60, 5, generator=torch.Generator().manual_seed(1))
    fast, plain = srm.layer(one), neurons.spike(neurons.psp(other.transpose(1, 2))).transpose(1, 2)
    assert 0.02 < plain.mean() < 0.5
    assert torch.equal(fast, plain)
    (fast * towards).sum().backward()
    (plain * towards).sum().backward()
    assert one.grad is not None and other.grad is not None
    assert (one.grad - other.grad).abs().max() < 1e-5


def test_a_spike_s_response_is_the_alpha_kernel() -> None:
    spikes = torch.zeros(1, 40)
    spikes[0, 5] = 1
    t = np.arange(35)
    np.testing.assert_allclose(srm.Srm(40).psp(spikes)[0, 5:], t / 10 * np.exp(1 - t / 10), atol=1e-6)


def test_the_gradient_of_a_spike_is_the_surrogate() -> None:
    drive = torch.tensor([[0.0, 4.0, 9.9, -30.0]], requires_grad=True)  # below threshold: no refractoriness
    srm.Srm(4).spike(drive).sum().backward()
    assert drive.grad is not None
    torch.testing.assert_close(drive.grad, 0.1 * torch.exp(-(drive.detach() - 10).abs() / 10))


def test_the_count_loss_is_half_the_squared_difference_of_counts() -> None:
    neurons, spikes = srm.Srm(20), torch.zeros(1, 2, 20, requires_grad=True)
    loss = neurons.count_loss(spikes, torch.tensor([[5.0, 0.0]]))
    assert loss.item() == pytest.approx(0.5 * 20 * (5 / 20) ** 2)
    loss.backward()
    assert spikes.grad is not None
    assert (spikes.grad[0, 0, :-1] < 0).all() and not spikes.grad[0, 1].any()


def test_input_neurons_spike_as_their_responses_add_up() -> None:
    rng, neurons = np.random.default_rng(3), InputNeurons((60, 3, 5))
    for _ in range(2):  # what is kept between windows leaves no trace
        pixels = rng.integers(0, 17, (2, 60, 3, 5)) * (rng.random((2, 60, 3, 5)) < 0.08)
        cells = np.flatnonzero(pixels)
        by_time = cells[np.argsort(cells // 15 % 60, kind="stable")]
        found = neurons(Occupancy(by_time, (pixels.ravel()[by_time] / 16).astype(np.float32)))
        drive = np.moveaxis(pixels, 1, -1) @ srm.responses(srm.TAU, 60).double().numpy() * POOL_WEIGHT * srm.THETA
        expected = brute_spikes(drive)
        assert expected.sum() == found.spikes > 20
        grid = patterns.dense([found], neurons.units, 60)[0].T
        np.testing.assert_array_equal(grid.numpy(), expected.reshape(30, 60))


def test_counts_and_voxels_by_hand() -> None:
    events = WindowEvents(
        np.array([0, 40, 99], np.uint32),
        np.array([0, 3, 4], np.uint8),
        np.array([1, 1, 5], np.uint8),
        np.array([True, False, True]),
    )
    grid = counts_in(events, (6, 6), 100, range(2), 4)
    assert grid.shape == (2, 2, 2, 2)
    assert {tuple(place) for place in np.argwhere(grid)} == {(0, 0, 0, 0), (0, 1, 0, 0), (1, 0, 1, 1)}
    voxels = voxel_grid(events, (6, 6), 100, 3, 2)
    assert voxels.sum() == pytest.approx(1.0)
    assert voxels[:, 0, 1] == pytest.approx([-0.2, -0.8, 0.0])
    assert voxels[:, 2, 2] == pytest.approx([0.0, 0.02, 0.98], abs=1e-6)
