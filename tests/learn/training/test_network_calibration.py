"""Calibration on windows whose truth is drawn from what the network should have said."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from evslip.learn import build_model
from evslip.learn.inference import answers
from evslip.learn.networks.speed_network import SpeedNetwork
from evslip.learn.speed_estimate import SpeedEstimate
from evslip.learn.training.calibration import FEWEST, calibrate, spread, temperature
from evslip.windows.label import Label
from evslip.windows.window_events import WindowEvents
from slip_records import slip_windows


@given(st.floats(0.4, 5.0))
def test_the_temperature_of_a_detector_that_is_too_sure_or_not_sure_enough(factor: float) -> None:
    rng = np.random.default_rng(0)
    odds = rng.normal(0, 2, 40_000)
    slips = rng.random(len(odds)) < 1 / (1 + np.exp(-odds))
    assert temperature(1 / (1 + np.exp(-odds * factor)), slips) == pytest.approx(factor, rel=0.05)


def test_a_few_windows_that_are_all_right_make_nobody_certain() -> None:
    slips = np.arange(20) < 10
    p_slip = np.where(slips, 0.9, 0.1)
    odds = np.log(9) / temperature(p_slip, slips)
    assert 1 / (1 + np.exp(-odds)) == pytest.approx(11 / 12, abs=0.001)


@given(st.floats(0.2, 4.0))
def test_the_spread_makes_intervals_hold_their_share(factor: float) -> None:
    rng = np.random.default_rng(0)
    median = np.expm1(rng.uniform(3, 5, 20_000))
    true = np.expm1(rng.laplace(np.log1p(median), 0.2 * factor))
    true[::7] = np.nan
    assert spread(true, SpeedEstimate(median, np.full(len(true), 0.2))) == pytest.approx(factor, rel=0.1)
    assert spread(true[:FEWEST], SpeedEstimate(median[:FEWEST], np.full(FEWEST, 0.2))) == 1


def test_answers_of_a_network_follow_its_calibration() -> None:
    torch.manual_seed(0)
    network, windows = build_model("slipnet"), slip_windows(4)
    assert isinstance(network, SpeedNetwork)
    before = answers(network, windows)
    calibrate(network, windows)
    network.spread[:] = torch.tensor([2.0, 0.5])
    after = answers(network, windows)
    odds = [np.log(found.p_slip / (1 - found.p_slip)) for found in (before, after)]
    np.testing.assert_allclose(odds[1] * network.temperature.item(), odds[0], rtol=1e-3, atol=1e-4)
    np.testing.assert_allclose(after.rotation_speed.scale, 2 * before.rotation_speed.scale, rtol=1e-5)
    np.testing.assert_allclose(after.slide_speed.scale, before.slide_speed.scale / 2, rtol=1e-5)
    np.testing.assert_array_equal(after.rotation_speed.median, before.rotation_speed.median)


@pytest.mark.parametrize("enough", [True, False])
def test_the_calibration_of_a_detector_that_training_started_from_is_corrected_not_replaced(enough: bool) -> None:
    """What was found before does not matter: the same weights are as sure on the same windows. Where a few windows say
    nothing of the spread, it stays that of the start."""
    number = 400 if enough else FEWEST - 1
    rng = np.random.default_rng(0)
    speeds = np.expm1(rng.laplace(3.0, 0.4, (2, number))).astype(np.float32)
    windows = replace(
        slip_windows(2).take(np.zeros(number, np.int64)),
        label=np.where(np.arange(number) % 2, Label.HOLD, Label.SLIP).astype(np.uint8),
        rotation_speed_deg_s=speeds[0],
        slide_speed_mm_s=speeds[1],
    )
    found = []
    for temperature_before, spread_before in ((1.0, [1.0, 1.0]), (0.7, [0.6, 1.8])):
        network = InARow(number)
        network.temperature.fill_(temperature_before)
        network.spread[:] = torch.tensor(spread_before)
        calibrate(network, windows)
        found.append((network.temperature.item(), network.spread.numpy()))
    assert found[1][0] == pytest.approx(found[0][0], rel=1e-3) and abs(found[0][0] - 1) > 0.1
    np.testing.assert_allclose(found[1][1], found[0][1] if enough else [0.6, 1.8], rtol=1e-4)


class InARow(SpeedNetwork):
    """A network whose answers are given: of slips and holds in turn, mostly right; speeds of one median and scale."""

    def __init__(self, number: int):
        super().__init__()
        odds = np.random.default_rng(1).normal(1.0, 1.0, number) * np.where(np.arange(number) % 2, -1, 1)
        columns = np.zeros((number, 6), np.float32)
        columns[:, 1], columns[:, 2::2], columns[:, 3::2] = odds, 3.0, np.log([0.2, 0.5])
        self._columns, self._asked = torch.from_numpy(columns), 0

    def prepare(self, events: WindowEvents) -> int:
        self._asked += 1
        return self._asked - 1

    def forward(self, batch: Sequence[int]) -> torch.Tensor:
        return self._columns[list(batch)]
