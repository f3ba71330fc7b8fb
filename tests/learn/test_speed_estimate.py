"""Speeds with their uncertainty: quantiles, likelihood, and the loss that finds them."""

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from evslip.learn.networks.speed_network import estimates, speed_loss
from evslip.learn.speed_estimate import FASTEST, SpeedEstimate

scales = st.floats(0.05, 1.5)
speeds = st.floats(0.0, 400.0)


def one(median: float, scale: float, n: int = 1) -> SpeedEstimate:
    return SpeedEstimate(np.full(n, median), np.full(n, scale))


@given(speeds, scales, st.sampled_from([0.5, 0.68, 0.9]))
def test_an_interval_holds_its_share(median: float, scale: float, share: float) -> None:
    draws = np.expm1(np.random.default_rng(0).laplace(np.log1p(median), scale, 40_000))
    low, high = one(median, scale, len(draws)).interval(share)
    assert (low >= 0).all() and (low <= median + 1e-9).all() and (high >= median - 1e-9).all()
    inside = (np.maximum(draws, 0) >= low - 1e-9) & (draws <= high)
    tail = (1 - share) / 2 if low[0] == 0 else 1 - share  # below no speed there is nothing
    assert inside.mean() == pytest.approx(1 - tail, abs=0.02)


@given(speeds, speeds, scales)
def test_surprise_is_the_likelihood_of_a_laplace_distribution(true: float, median: float, scale: float) -> None:
    centre, spread, value = (torch.tensor(v, dtype=torch.float64) for v in (np.log1p(median), scale, np.log1p(true)))
    expected = -torch.distributions.Laplace(centre, spread).log_prob(value)
    assert one(median, scale).surprise(np.array([true]))[0] == pytest.approx(float(expected), abs=1e-6)


def test_the_loss_finds_median_and_scale() -> None:
    """Of speeds with known quantiles, some of which nobody knows."""
    rng = np.random.default_rng(0)
    centres, spreads = np.log1p([20.0, 5.0]), np.array([0.4, 0.1])
    true = np.expm1(rng.laplace(centres, spreads, (4000, 2)))
    true[::3] = np.nan
    weights = torch.zeros(4, requires_grad=True)
    optimiser = torch.optim.Adam([weights], lr=0.05)
    for _ in range(400):
        optimiser.zero_grad()
        speed_loss(weights.expand(4000, 4), torch.from_numpy(true).float()).backward()
        optimiser.step()
    found = estimates(weights.detach()[None])[0].numpy()
    np.testing.assert_allclose(found[::2], [20, 5], rtol=0.05)
    np.testing.assert_allclose(found[1::2], spreads, rtol=0.1)


def test_no_speed_is_beyond_what_a_hand_can_lose() -> None:
    found = estimates(torch.tensor([[7.0, 0.0, 12.0, 0.0], [-3.0, 0.0, 100.0, 0.0]]))[:, ::2].numpy()
    np.testing.assert_allclose(found, [[np.expm1(7.0), FASTEST], [0.0, FASTEST]], rtol=1e-5)


@pytest.mark.parametrize("speed", [torch.nan, 0.0, 1.0])
def test_what_nobody_knows_and_what_does_not_slip_teaches_nothing(speed: float) -> None:
    weights = torch.zeros(3, 4, requires_grad=True)
    loss = speed_loss(weights, torch.full((3, 2), speed))
    loss.backward()
    assert loss.item() == 0 and weights.grad is not None and not weights.grad.any()


def test_what_turns_teaches_that_it_does_not_slide() -> None:
    columns = torch.ones((2, 4), requires_grad=True)
    speed_loss(columns, torch.tensor([[50.0, 0.0], [0.0, 0.0]])).backward()
    assert columns.grad is not None and columns.grad[0].all() and not columns.grad[1].any()


def test_a_certain_window_moves_the_median_no_more_than_another() -> None:
    columns = torch.tensor([[1.0, -3.0, 1.0, 1.0]], requires_grad=True)
    speed_loss(columns, torch.tensor([[50.0, 50.0]])).backward()
    assert columns.grad is not None and columns.grad[0, 0] == columns.grad[0, 2]
