"""Windows answered from what has changed are answered as whole windows are."""

import numpy as np
import pytest
import torch

from evslip.events.stream import Events
from evslip.learn.layers.grids import counts_in
from evslip.learn.layers.rolling_counts import RollingConvolution, RollingCounts
from evslip.learn.networks.countnet import CountNet
from evslip.learn.networks.network import Geometry
from evslip.learn.streaming.following import RollingCountNet, following
from evslip.learn.streaming.stream import Detector
from evslip.windows.settings import WindowSettings
from evslip.windows.window_events import WindowEvents

LENGTH_US = 160_001  # no multiple of the bins


def some_events(count: int, seconds: float, seed: int = 0) -> Events:
    rng = np.random.default_rng(seed)
    t_us = np.sort(rng.integers(0, int(seconds * 1e6), count))
    x, y = rng.integers(0, 346, count, np.uint16), rng.integers(0, 260, count, np.uint16)
    return Events(t_us, x, y, rng.integers(0, 2, count) == 1)


@pytest.mark.parametrize("hop_us", [1_000, 7_777, 200_000])
def test_counts_that_roll_are_those_of_every_window(hop_us):
    events = some_events(150_000, 1.0)
    rolling, pushed = RollingCounts((73, 10), (198, 250), LENGTH_US, 5, 4), 0
    for end_us in range(LENGTH_US, 1_000_000, hop_us):
        upto = int(np.searchsorted(events.t_us, end_us + 500))  # some events from behind the window, too
        rolling.push(*events.select(slice(pushed, upto)).columns)
        pushed = upto
        rolling.advance(end_us)
        window = events.between(end_us - LENGTH_US, end_us)
        x, y = window.x.astype(int) - 73, window.y.astype(int) - 10
        inside = (x >= 0) & (x < 198) & (y >= 0) & (y < 250)
        own = WindowEvents(window.t_us[inside] - (end_us - LENGTH_US), x[inside], y[inside], window.p[inside])
        expected = counts_in(own, (198, 250), LENGTH_US, range(5), 4).reshape(rolling.counts.shape)
        assert rolling.events == inside.sum()
        assert np.array_equal(rolling.counts, expected)


def test_convolution_of_changes_is_that_of_the_whole():
    rng = np.random.default_rng(0)
    weight, constant = (torch.from_numpy(rng.normal(size=n).astype(np.float32)) for n in ((8, 4, 3, 3), (8, 9, 7)))
    convolution, numbers = RollingConvolution(weight, constant, again=40), rng.integers(0, 9_000, (4, 9, 7), np.int32)
    for i in range(100):
        changed = rng.random(numbers.shape) < (0.5 if i % 7 == 0 else 0.1)
        numbers[changed] = rng.integers(0, 9_000, int(changed.sum()))
        grids = torch.from_numpy(np.log1p(numbers.astype(np.float32)))[None]
        expected = torch.nn.functional.conv2d(grids, weight, padding=1)[0] + constant
        assert torch.allclose(convolution(numbers).permute(2, 0, 1), expected, atol=2e-4)


@pytest.mark.parametrize("seed", [1, 2])
def test_rolling_detector_answers_as_the_dense_one(seed):
    first, second = some_events(60_000, 0.5, seed), some_events(600_000, 0.5, seed + 10)
    events = Events(*map(np.concatenate, zip(first.columns, (second.t_us + 900_000, *second.columns[1:]), strict=True)))
    found = {}
    for rolling in (False, True):
        detector = Detector("default-complex", hop_s=0.003, rolling=rolling)
        parts = [detector.follow(part, newest=11) for part in events.chunks(duration_us=40_000)]
        detector.restart()
        parts.append(detector.follow(first))
        columns = ((one.t_us, one.p_slip, one.events) for one in parts)
        found[rolling] = [np.concatenate(column) for column in zip(*columns, strict=True)]
    assert np.array_equal(found[True][0], found[False][0]) and np.array_equal(found[True][2], found[False][2])
    assert len(np.unique(found[True][1])) > 100
    assert np.allclose(found[True][1], found[False][1], atol=2e-5)


@pytest.mark.parametrize("size", [(16, 16), (64, 48), (160, 120)])
def test_any_crop_can_be_followed(size):
    """Small pictures take other machine code than large ones."""
    torch.manual_seed(0)
    settings = WindowSettings(left=3, top=2, width=size[0], height=size[1])
    network = CountNet(Geometry.of(settings)).eval()
    events, ends_us = some_events(40_000, 0.6), np.arange(160_000, 600_000, 30_000)
    found = []
    for rolling in (False, True):
        follower = following(network, settings, rolling)
        follower.push(events)
        found.append(follower.answers(ends_us))
    assert isinstance(follower, RollingCountNet) and len(np.unique(found[0][0][:, 0])) > 10
    assert np.allclose(found[0][0][:, 0], found[1][0][:, 0], atol=2e-5)
    assert np.array_equal(found[0][1], found[1][1])
