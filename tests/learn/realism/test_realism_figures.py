"""Figures of realism, against counts by hand, theory and other libraries."""

import dataclasses
import json
import math
import tracemalloc

import numpy as np
import pytest
from scipy.stats import ks_2samp

from evslip.data.footage import Footage
from evslip.events.intervals import intervals_us
from evslip.events.stream import Events
from evslip.learn.realism import two_sample
from evslip.learn.realism.cells import Cells, agreement, counts
from evslip.learn.realism.levels import rates_by_level
from evslip.learn.realism.oracle import frame_counts
from evslip.learn.realism.realism import Pair, compare
from evslip.learn.realism.timing import ks_distance, rate_spectrum, spectrum_distance_db
from evslip.utils.errors import DataError

SIZE = (50, 36)


def at_random(seed: int, rate_hz: float, seconds: float = 0.4, on: float = 0.5, size: tuple[int, int] = SIZE) -> Events:
    """A Poisson process at every pixel."""
    rng = np.random.default_rng(seed)
    number = rng.poisson(rate_hz * seconds * size[0] * size[1])
    t_us = np.sort(rng.integers(0, round(1e6 * seconds), number))
    x, y = (rng.integers(0, side, number).astype(np.uint16) for side in size)
    return Events(t_us, x, y, rng.random(number) < on)


def listed(*rows: tuple[int, int, int, int]) -> Events:
    """Events of (t_us, x, y, p)."""
    t_us, x, y, p = zip(*rows, strict=True)
    return Events(np.array(t_us), np.array(x, np.uint16), np.array(y, np.uint16), np.array(p, bool))


def pair(real: Events, simulated: Events, **more) -> Pair:
    return Pair(real, simulated, SIZE, 0, 400_000, **more)


def test_events_are_counted_in_their_cells():
    events = listed((999, 0, 0, 1), (1000, 3, 3, 1), (1500, 4, 3, 1), (2999, 49, 35, 0), (3000, 49, 35, 0))
    counted = counts(events, Cells(SIZE, 1000, 3500, 4, 1000))
    assert counted.shape == (2, 2, 9, 13)
    assert {tuple(map(int, place)): counted[tuple(place)] for place in np.argwhere(counted)} == {
        (1, 0, 0, 0): 1,
        (1, 0, 0, 1): 1,
        (0, 1, 8, 12): 1,
    }


def test_agreement_is_what_its_definition_says():
    found = agreement(np.array([2.0, 0.0, 1.0, 1.0]), np.array([1.0, 1.0, 0.0, 3.0]))
    assert (found.total, found.l1_per_event) == (4 / 5, 5 / 5)
    assert found.correlation == pytest.approx(np.corrcoef([2, 0, 1, 1], [1, 1, 0, 3])[0, 1])
    assert all(math.isnan(figure) for figure in agreement(np.ones(3), np.zeros(3)))
    assert math.isnan(agreement(np.ones(3), np.arange(3.0)).correlation)


def test_intervals_are_those_of_one_pixel():
    events = listed((0, 1, 1, 1), (5, 2, 1, 1), (10, 1, 1, 0), (12, 1, 2, 1), (40, 1, 1, 1), (45, 2, 1, 0))
    assert sorted(intervals_us(events, SIZE[0])[0].tolist()) == [10, 30, 40]


@pytest.mark.parametrize("sizes", [(1, 1), (500, 300), (40, 2000)])
def test_the_distance_of_distributions_is_scipys(sizes):
    rng = np.random.default_rng(0)
    first, second = rng.integers(0, 50, sizes[0]), rng.integers(5, 70, sizes[1])
    assert ks_distance(first, second) == pytest.approx(ks_2samp(first, second).statistic)
    assert math.isnan(ks_distance(first, second[:0]))


def test_rate_and_polarity_by_level_are_those_put_in():
    rng = np.random.default_rng(2)
    levels = rng.choice([20, 60, 120, 200, 255], (SIZE[1], SIZE[0])).astype(np.uint8)
    footage = Footage(np.array([-1000, 300_000, 900_000]), np.stack([levels, 255 - levels, levels]))
    # The second frame is nearest from 0.1495 s on; the third never.
    rates = {20: (3.0, 0.9), 60: (6.0, 0.5), 120: (20.0, 0.2), 200: (10.0, 1.0), 255: (40.0, 0.5)}
    parts = []
    for number, (code, (rate_hz, on)) in enumerate(rates.items()):
        events = at_random(number, rate_hz, on=on)
        shown = np.where(events.t_us < 149_500, levels[events.y, events.x], 255 - levels[events.y, events.x])
        parts.append(events.select(shown == code))
    merged = Events(*(np.concatenate(columns) for columns in zip(*(part.columns for part in parts), strict=True)))
    merged = merged.select(np.argsort(merged.t_us, kind="stable"))
    found = rates_by_level(merged, footage, 0, 400_000)
    assert found.pixel_s.sum() == pytest.approx(0.4 * SIZE[0] * SIZE[1])
    # Codes of the second frame that are no level of the first (235, 195, 135, 55, 0) have no events.
    shown_s = {code: 0.1495 * (levels == code).sum() + 0.2505 * (255 - levels == code).sum() for code in rates}
    for number, (code, (rate_hz, on)) in enumerate(rates.items()):
        events_put_in = rate_hz * shown_s[code]
        assert found.on[number] + found.off[number] == pytest.approx(events_put_in, abs=5 * np.sqrt(events_put_in))
        assert found.on_share[number] == pytest.approx(on, abs=5 * np.sqrt(0.25 / events_put_in))


def test_events_at_random_have_a_flat_spectrum():
    events = at_random(0, 30.0, seconds=4.0)
    hz, power = rate_spectrum(events, 0, 4_000_000)
    assert power.mean() == pytest.approx(2 * len(events) / 4, rel=0.1)  # shot noise, one-sided
    assert hz[-1] == 500
    assert spectrum_distance_db(power, 10 * power) == pytest.approx(10)
    assert math.isnan(spectrum_distance_db(power, 0 * power))


def test_the_oracle_loses_what_cancels_between_two_frames():
    cells = Cells(SIZE, 0, 80_000, 4, 40_000)
    events = listed((1000, 5, 5, 1), (2000, 5, 5, 1), (3000, 5, 5, 0), (50_000, 9, 9, 1), (60_000, 9, 9, 0))
    found = frame_counts(events, np.array([-5000, 20_000, 70_000]), cells)
    assert found.sum() == pytest.approx(1)
    assert found[1, 0, 1, 1] == pytest.approx(1)
    # Without opposites it is exact, but for the times within an interval.
    events = listed((10_000, 5, 5, 1), (30_000, 9, 9, 0))
    found = frame_counts(events, np.array([20_000, 60_000]), cells)
    assert (found[1, 0, 1, 1], found[0, 0, 2, 2], found[0, 1, 2, 2]) == pytest.approx((1, 0.5, 0.5))


def test_equal_streams_are_perfect():
    real = at_random(0, 20.0)
    found = compare(pair(real, real, other_draw=at_random(1, 20.0)))
    assert (found.fine.total, found.fine.l1_per_event, found.ks) == (1, 0, 0)
    assert found.fine.correlation == pytest.approx(1)
    assert found.two_sample is not None
    assert found.two_sample.accuracy == 0.5
    assert found.floor is not None
    assert found.floor.l1_per_event > 0.2
    assert found.variance_over_mean[0] == pytest.approx(1, abs=0.1)


def test_the_floor_of_poisson_counts_is_theirs():
    """Two Poisson counts of mean m differ by 2/sqrt(pi) sqrt(m) on average, where m is large."""
    first, second = at_random(0, 400.0), at_random(1, 400.0)
    found = compare(pair(first, first, other_draw=second), classifier=False)
    mean = 400 * 16 * 0.04 / 2
    assert found.floor is not None
    # Cells at the rim are smaller, of fewer events.
    assert found.floor.l1_per_event == pytest.approx(2 / np.sqrt(np.pi * mean), rel=0.06)


def test_the_classifier_finds_other_polarities_and_no_difference_of_draws(monkeypatch):
    size, span = (128, 96), (0, 400_000)
    real, same, other = (at_random(n, 4.0, on=on, size=size) for n, on in enumerate((0.5, 0.5, 0.8)))
    told = two_sample.classifier_test(real, same, size, span, 0)
    assert told.pairs == 20 * 12
    assert told.accuracy == pytest.approx(0.5, abs=0.09)
    found = two_sample.classifier_test(real, other, size, span, 0)
    assert found.accuracy > 0.85
    assert found == two_sample.classifier_test(real, other, size, span, 0)
    monkeypatch.setattr(two_sample, "MOST_PAIRS", 30)
    assert two_sample.classifier_test(real, same, size, span, 0).pairs == 30


def test_samples_are_the_counts_of_single_pixels_in_their_tiles():
    streams = at_random(0, 5.0), at_random(1, 5.0)
    *grids, window = two_sample._pairs(*streams, SIZE, (7_000, 399_000), 0)
    assert np.array_equal(window, np.repeat(np.arange(19), 4))  # tiles at the right and at the bottom are there, too
    for events, grid in zip(streams, grids, strict=True):
        whole = counts(events, Cells(SIZE, 7_000, 387_000, 1, 5_000))
        filled = np.pad(whole, ((0, 0), (0, 0), (0, 64 - SIZE[1]), (0, 64 - SIZE[0])))
        for number, own in enumerate(grid):
            y, x = 32 * (number % 4 // 2), 32 * (number % 2)
            tile = filled[:, 4 * window[number] :, y : y + 32, x : x + 32][:, :4].reshape(8, 32, 32)
            assert np.array_equal(own, np.log1p(tile.astype(np.float32)))


def test_a_long_stretch_needs_memory_for_the_samples_alone():
    size = (346, 260)
    streams = [at_random(n, 0.01, seconds=2.0, size=size) for n in range(2)]
    tracemalloc.start()
    two_sample._pairs(*streams, size, (0, 2_000_000), 0)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 50e6  # single pixels of all tiles: 2 GB


def test_streams_with_hardly_an_event_give_no_pair():
    few = listed((100, 1, 1, 1), (90_000, 2, 2, 0))
    told = two_sample.classifier_test(few, few, SIZE, (0, 400_000), 0)
    assert told.pairs == 0 and math.isnan(told.accuracy)


def test_json_has_every_figure_and_no_nan():
    real = at_random(0, 20.0)
    footage = Footage(np.array([0, 200_000]), np.full((2, SIZE[1], SIZE[0]), 100, np.uint8))
    nothing = at_random(0, 0.0)
    for simulated in (at_random(1, 30.0), nothing):
        said = compare(pair(real, simulated, footage=footage), classifier=False).as_json()
        text = json.dumps(said, allow_nan=False)
        keys = {"total", "l1_per_event", "correlation", "l1_per_event_8x8", "floor", "ks", "two_sample_accuracy"}
        assert keys < json.loads(text).keys()
        assert [row["level"] for row in said["rate_by_level"]][2] == "80-160"
        assert said["rate_by_level"][0]["rate_hz"] == {"real": None, "simulated": None}
    assert (said["total"], said["l1_per_event"], said["ks"]) == (0, 1, None)


def test_without_torch_a_line_says_so(monkeypatch):
    real = at_random(0, 20.0)
    monkeypatch.setattr("evslip.learn.realism.realism.find_spec", lambda name: None)
    found = compare(pair(real, real))
    assert found.as_json()["two_sample_accuracy"] is None
    assert any("pip install 'evslip[learn]'" in note for note in found.notes)


def test_a_stretch_needs_a_length_and_events():
    real = at_random(0, 20.0)
    with pytest.raises(DataError, match=r"start-s, end-s: 0\.050 s to score; expected 0\.08 s"):
        compare(pair(real, real)._replace(end_us=50_000))
    with pytest.raises(DataError, match="start-s, end-s: the recording has no event"):
        compare(pair(real, real)._replace(start_us=500_000, end_us=900_000))


def test_only_the_stretch_counts():
    real, simulated = at_random(0, 20.0), at_random(1, 20.0)
    whole = compare(pair(real, simulated)._replace(start_us=100_000, end_us=300_000), classifier=False)
    cut = pair(real.between(100_000, 300_000), simulated.between(100_000, 300_000))
    part = compare(cut._replace(start_us=100_000, end_us=300_000), classifier=False)
    for field in dataclasses.fields(whole):
        np.testing.assert_equal(getattr(whole, field.name), getattr(part, field.name))
