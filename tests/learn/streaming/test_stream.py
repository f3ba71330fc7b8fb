"""The streaming detector against windows cut one by one, through silence and disorder."""

from pathlib import Path

import numpy as np
import pytest
import torch

from evslip.events.stream import Events, empty_events
from evslip.learn import Detector, build_model, detect
from evslip.learn.checkpoint import Description, save_model
from evslip.learn.inference import Answers, predict, probabilities
from evslip.learn.networks import register
from evslip.learn.networks.countnet import CountNet
from evslip.learn.streaming.following import WholeWindows
from evslip.utils.errors import ConfigError, DataError
from evslip.windows.cutting import crop, windows_of
from evslip.windows.window_events import WindowEvents
from evslip.windows.window_set import WindowSettings
from slip_records import HELD, SIZE, slip_record, turning


@pytest.fixture(scope="module")
def model(tmp_path_factory) -> Path:
    """Fresh weights: what a stream gives must not depend on how good the answers are."""
    torch.manual_seed(0)
    folder = tmp_path_factory.mktemp("model")
    save_model(folder, build_model("cnn3d"), Description("cnn3d", 0.5, WindowSettings(), {}))
    return folder


def test_answers_equal_those_on_the_windows(model: Path) -> None:
    record = slip_record("a", turning(600, 1900, 15.0))
    # One event at the start of holding, so that the detector's hops fall on the windows' starts.
    start_us = HELD.start * 1000
    events = record.events.between(start_us, 2_400_000)
    first = Events(np.array([start_us]), np.zeros(1, np.uint16), np.zeros(1, np.uint16), np.ones(1, bool))
    events = Events(*(np.concatenate([a, b]) for a, b in zip(first.columns, events.columns, strict=True)))
    windows = windows_of([record], WindowSettings(balance=False, hold_deg=1, hold_mm=2))
    found = detect(model, events, SIZE, hop_s=0.16)
    which = np.isin(found.t_us, windows.start_us + 160_000)
    assert which.sum() == len(windows) == 13
    detector = Detector(model)
    expected = probabilities(detector._network, windows)
    np.testing.assert_allclose(found.p_slip[which], expected, atol=1e-5)
    np.testing.assert_array_equal(found.events[which], windows.events)


def test_speeds_are_those_of_the_windows(tmp_path: Path) -> None:
    """In parts or at once, in silence too; a detector that does not estimate them has none."""
    torch.manual_seed(0)
    save_model(tmp_path, build_model("slipnet"), Description("slipnet", 0.5, WindowSettings(), {}))
    record = slip_record("a", turning(600, 1900, 15.0))
    events = record.events.between(0, 1_000_000)
    detector = Detector(tmp_path, hop_s=0.02)
    found = detect(tmp_path, (events.select(slice(i, i + 700)) for i in range(0, events.count, 700)), SIZE)
    first = int(events.t_us[0])
    starts = found.t_us - 160_000
    inside = crop(events, WindowSettings())
    windows = [WindowEvents.of(inside.between(start, start + 160_000), start) for start in starts.tolist()]
    expected = Answers.of(predict(detector._network, [detector._network.prepare(window) for window in windows]))
    assert found.t_us[0] == first + 160_000
    for speed, wanted in ((found.rotation_speed, expected[1]), (found.slide_speed, expected[2])):
        assert speed is not None
        for column, values in zip(speed, wanted, strict=True):
            np.testing.assert_allclose(column, values, rtol=1e-4)
            assert np.isfinite(column).all() and column.shape == found.t_us.shape
    last = int(events.t_us[-1])
    silent = Detector(tmp_path).follow(events.select(slice(0, 1)), until_us=last).rotation_speed
    assert silent is not None and silent.median[-1] == silent.median[-2]


def test_a_detector_without_speeds_has_none(model: Path) -> None:
    found = detect(model, slip_record("a", turning(600, 1900, 15.0)).events, SIZE, hop_s=0.5)
    assert found.rotation_speed is None and found.slide_speed is None


def test_silence_is_answered_too(model: Path) -> None:
    detector = Detector(model, hop_s=0.1)
    assert len(detector.follow(empty_events()).t_us) == 0
    one = Events(np.array([1_000_000]), np.array([100], np.uint16), np.array([100], np.uint16), np.ones(1, bool))
    assert len(detector.follow(one).t_us) == 0
    answers = detector.follow(empty_events(), until_us=1_500_000)
    assert answers.t_us.tolist() == [1_160_000, 1_260_000, 1_360_000, 1_460_000]
    assert answers.events.tolist() == [1, 0, 0, 0]
    assert isinstance(detector._windows, WholeWindows) and len(detector._windows._kept.t_us) == 0


def test_memory_is_bounded_by_a_window(model: Path) -> None:
    events = slip_record("a", turning(600, 1900, 15.0)).events
    detector = Detector(model, hop_s=0.02)
    for i in range(0, events.count, 500):
        detector.follow(events.select(slice(i, i + 500)))
        assert isinstance(detector._windows, WholeWindows)
        kept = detector._windows._kept
        assert not len(kept.t_us) or kept.t_us[-1] - kept.t_us[0] <= 160_000


def test_events_out_of_order_are_refused(model: Path) -> None:
    events = slip_record("a", turning(600, 1900, 15.0)).events
    detector = Detector(model)
    detector.follow(events.select(slice(2000, 2500)))
    with pytest.raises(DataError, match="time order"):
        detector.follow(events.select(slice(0, 10)))


@pytest.mark.parametrize("hop_s", [0, -0.1, float("nan")])
def test_wrong_hop(model: Path, hop_s: float) -> None:
    with pytest.raises(ConfigError, match="hop_s"):
        Detector(model, hop_s=hop_s)


def test_parts_of_a_stream_give_the_answers_of_the_whole(model: Path) -> None:
    events = slip_record("a", turning(600, 1900, 15.0)).events
    whole = detect(model, events, SIZE)
    parts = detect(model, (events.select(slice(i, i + 700)) for i in range(0, events.count, 700)), SIZE)
    for name in ("t_us", "events"):
        np.testing.assert_array_equal(getattr(parts, name), getattr(whole, name))
    # Parts make batches of other sizes, elsewhere in memory: PyTorch may add in another order.
    np.testing.assert_allclose(parts.p_slip, whole.p_slip, rtol=0, atol=1e-6)
    assert parts.start_us == whole.start_us and parts.threshold == whole.threshold


@pytest.mark.parametrize("last_us", [2**45, 2**62])
def test_a_broken_clock_is_refused(model: Path, last_us: int) -> None:
    pixel = np.full(2, 100, np.uint16)
    events = Events(np.array([-(2**62), last_us]), pixel, pixel, np.ones(2, bool))
    with pytest.raises(DataError, match=r"no event for .* s; expected no gap of over an hour"):
        detect(model, events, SIZE)
    one = events.select(slice(1))
    with pytest.raises(DataError, match=r"no event for .* s; expected no gap of over an hour"):
        Detector(model, size=SIZE, hop_s=10.0).follow(one, last_us)
    hours = np.arange(2000) * 3_599_000_000
    events = Events(hours, *(np.full(2000, 100, np.uint16),) * 2, np.ones(2000, bool))
    with pytest.raises(DataError, match="at most 5,000,000 answers"):
        detect(model, events, SIZE)


EVENTS = Events(np.arange(3) * 1000, np.zeros(3, np.uint16), np.zeros(3, np.uint16), np.ones(3, bool))


@pytest.mark.parametrize(
    ("events", "words"),
    [
        (EVENTS.replace(x=np.full(3, 400, np.uint16)), r"events/x: 400 is out of range, expected 0 to 345"),
        (EVENTS.replace(p=np.array([1, -1, 1])), r"events/p: int64 of shape \(3,\), expected bool"),
        (EVENTS.replace(t_us=EVENTS.t_us[::-1]), "times must never decrease"),
        (EVENTS.replace(t_us=EVENTS.t_us.astype(float)), "events/t_us: float64"),
        (EVENTS.replace(t_us=[0, 1, 2]), "events/t_us: list, expected an array of int64"),
        (EVENTS.to_structured(), "ndarray, expected Events; Events.from_structured makes them"),
    ],
)
def test_events_that_are_none_or_not_of_this_sensor_are_refused(events, words: str, model: Path) -> None:
    with pytest.raises(DataError, match=words):
        Detector(model).push(events)
    with pytest.raises(DataError, match=words):
        detect(model, events if isinstance(events, Events) else [events], SIZE)


@pytest.mark.parametrize("size", [640, (346,), (346, 260.0), "ab", (0, 260)])
def test_a_size_that_is_none_is_refused(size, model: Path) -> None:
    with pytest.raises(ConfigError, match=r"size: .* expected"):
        Detector(model, size=size)


def test_a_size_may_be_a_list_or_an_array(model: Path) -> None:
    for size in ([346, 260], np.array([346, 260])):
        assert np.isnan(Detector(model, size=size).push(EVENTS))


def test_of_more_hops_one_at_least_is_answered(model: Path) -> None:
    with pytest.raises(ConfigError, match="newest: 0 is out of range, expected 1 or more"):
        Detector(model).follow(EVENTS, newest=0)


def test_what_is_refused_leaves_the_detector_as_it_was(model: Path) -> None:
    detector, hour_us = Detector(model, hop_s=0.001), 3_500_000_000
    far = EVENTS.select(slice(0, 3)).replace(t_us=np.array([0, hour_us, 2 * hour_us]))
    with pytest.raises(DataError, match="shorter pieces"):
        detector.follow(far)
    with pytest.raises(DataError, match="until_us: 1180591620717411303424 is out of range"):
        detector.follow(EVENTS, until_us=2**70)
    fresh = Detector(model, hop_s=0.001).follow(EVENTS, newest=5)
    assert np.array_equal(detector.follow(EVENTS, newest=5).p_slip, fresh.p_slip)


class Overflowing(CountNet):
    """Of windows with few events it makes what is no number, as a mean over nothing does."""

    def prepare(self, window: WindowEvents) -> torch.Tensor:
        grids = super().prepare(window)
        return grids * (np.nan if 0 < len(window.t_us) < 1000 else 1.0)


def test_an_answer_that_is_not_a_number_is_no_hold(tmp_path: Path) -> None:
    settings = WindowSettings()
    register(f"{__name__}:Overflowing")
    network = build_model(f"{__name__}:Overflowing")
    save_model(tmp_path, network, Description(f"{__name__}:Overflowing", 0.5, settings, {}))
    rng = np.random.default_rng(0)
    t_us = np.sort(rng.integers(0, 400_000, 500))
    few = Events(t_us, *(rng.integers(80, 200, 500, np.uint16) for _ in "xy"), t_us % 2 == 0)
    message = r"answers to \d+ of \d+ windows are not numbers"
    with pytest.raises(DataError, match=message):
        detect(tmp_path, few, SIZE)
    with pytest.raises(DataError, match=message):
        predict(network.eval(), [network.prepare(WindowEvents.of(few.between(0, 160_000), 0))])
