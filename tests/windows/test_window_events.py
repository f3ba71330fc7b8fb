"""Three bytes an event: nothing is lost, and damage is found."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from evslip.learn.layers.grids import counts_in
from evslip.learn.networks.network import Geometry
from evslip.learn.training.augment import Augmentation, backwards, flipped, merged, shifted, shot_noise
from evslip.learn.training.settings import TrainSettings
from evslip.windows.window_events import WindowEvents, pack, unpack
from evslip.windows.window_set import WindowSettings
from learn_windows import random_window


def events_of(gaps: list[int], seed: int = 0) -> WindowEvents:
    rng, n = np.random.default_rng(seed), len(gaps)
    x, y = (rng.integers(0, 256, n).astype(np.uint8) for _ in range(2))
    return WindowEvents(np.cumsum(gaps, dtype=np.int64).astype(np.uint32), x, y, rng.random(n) < 0.5)


@given(st.lists(st.one_of(st.integers(0, 3), st.sampled_from([126, 127, 128, 254, 100_000])), max_size=40))
@settings(max_examples=60)
def test_unpacking_undoes_packing(gaps: list[int]) -> None:
    events = events_of(gaps)
    packed = pack(events)
    assert packed.shape == (len(gaps) + sum(gap // 127 for gap in gaps), 3)
    back = unpack(packed, len(gaps))
    assert back is not None
    for one, other in zip(back.columns, events.columns, strict=True):
        np.testing.assert_array_equal(one, other)
        assert one.dtype == other.dtype


@given(st.lists(st.sampled_from([0, 5, 127, 300]), max_size=20), st.integers(0, 2**32))
def test_packing_keeps_columns_and_rows_beyond_256(gaps: list[int], seed: int) -> None:
    x, y = np.random.default_rng(seed).integers(0, 65536, (2, len(gaps)), np.uint16)
    events = WindowEvents(*events_of(gaps).columns[:1], x, y, events_of(gaps).p)
    back = unpack(pack(events), len(gaps))
    assert back == events and back is not None and back.x.dtype == np.uint16


def test_another_number_of_events_is_found() -> None:
    packed = pack(events_of([5, 300, 0, 7]))
    assert unpack(packed, 3) is None and unpack(packed, 5) is None and unpack(packed, 100) is None


GEOMETRY = Geometry()


def test_flipping_twice_and_shifting_back_change_nothing_inside() -> None:
    events = random_window(0, 500)
    for one, other in zip(flipped(flipped(events, 200), 200).columns, events.columns, strict=True):
        np.testing.assert_array_equal(one, other)
    away = shifted(events, 7, -4, GEOMETRY)
    stay = (events.x.astype(int) + 7 < 200) & (events.y.astype(int) - 4 >= 0)
    np.testing.assert_array_equal(away.t_us, events.t_us[stay])
    back = shifted(away, -7, 4, GEOMETRY)
    np.testing.assert_array_equal(back.x, events.x[stay])


def test_merging_keeps_all_events_in_order() -> None:
    one, other = random_window(1, 300), random_window(2, 200)
    both = merged(one, other)
    assert len(both.t_us) == 500 and (np.diff(both.t_us.astype(int)) >= 0).all()
    assert both.x.sum(dtype=int) == one.x.sum(dtype=int) + other.x.sum(dtype=int)


@given(st.integers(0, 10**6))
@settings(max_examples=20)
def test_augmentation_is_a_window_again_and_obeys_its_generator(seed: int) -> None:
    settings = TrainSettings(reverse=True, shift_px=20, time_dropout=0.5, event_dropout=0.5, noise_hz=0.1)
    augment = Augmentation(settings, WindowSettings())
    events = random_window(seed, 800)
    one, other = (augment(events, np.random.default_rng(seed)) for _ in range(2))
    assert one == other
    assert len(one.t_us) <= 800 + 1200 and (np.diff(one.t_us.astype(int)) >= 0).all()
    assert one.x.max(initial=0) < 200 and one.y.max(initial=0) < 250


def test_what_is_played_backwards_twice_is_what_it_was() -> None:
    events = random_window(3, 500)
    back = backwards(events, GEOMETRY.length_us)
    assert (np.diff(back.t_us.astype(int)) >= 0).all() and back.t_us.dtype == events.t_us.dtype
    assert back.t_us[-1] == GEOMETRY.length_us - 1 - events.t_us[0] and back.p[-1] != events.p[0]
    assert backwards(back, GEOMETRY.length_us) == events


def test_shot_noise_comes_at_its_rate_from_every_pixel_and_at_every_time() -> None:
    noise = shot_noise(4.0, GEOMETRY, np.random.default_rng(0))
    expected = 4.0 * 200 * 250 * 0.16
    assert abs(len(noise.t_us) - expected) < 5 * np.sqrt(expected)
    assert (np.diff(noise.t_us.astype(int)) >= 0).all() and noise.t_us.max() < 160_000
    for values, most in ((noise.t_us, 160_000), (noise.x, 200), (noise.y, 250), (noise.p.astype(int), 2)):
        shares = np.histogram(values, 2, (0, most))[0] / expected
        np.testing.assert_allclose(shares, 0.5, atol=0.02)
    assert (noise.x.max(), noise.y.max()) == (199, 249)


def test_noise_is_another_one_in_each_window_and_small_more_often_than_large() -> None:
    augment = Augmentation(TrainSettings(flip=False, noise_hz=5.0), WindowSettings())
    silence, rng = events_of([]), np.random.default_rng(0)
    counts = np.array([len(augment(silence, rng).t_us) for _ in range(200)]) / (5.0 * 200 * 250 * 0.16)
    assert counts.max() > 0.9 and counts.min() < 0.01
    assert 0.18 < np.median(counts) < 0.33


@given(*[st.lists(st.sampled_from([0, 0, 1, 40]), max_size=30)] * 2)
def test_merged_events_are_those_of_a_stable_sort(gaps: list[int], others: list[int]) -> None:
    one, other = events_of(gaps, 1), events_of(others, 2)
    order = np.argsort(np.concatenate([one.t_us, other.t_us]), kind="stable")
    for own, *pair in zip(merged(one, other).columns, one.columns, other.columns, strict=True):
        np.testing.assert_array_equal(own, np.concatenate(pair)[order])
        assert own.dtype == pair[0].dtype


@given(st.lists(st.sampled_from([0, 1, 7, 8, 900, 7999, 8000, 8001]), max_size=60))
def test_counts_are_a_histogram(gaps: list[int]) -> None:
    events, length, bin_of, pool = events_of(gaps), 160_000, (0, 0, 1, 2, 2, 3, 3), 3
    found = counts_in(events, (256, 256), length, bin_of, pool)
    step = np.minimum(events.t_us.astype(np.int64) * len(bin_of) // length, len(bin_of) - 1)
    expected = np.zeros_like(found)
    np.add.at(expected, (np.array(bin_of)[step], 1 - events.p.astype(int), events.y // pool, events.x // pool), 1)
    np.testing.assert_array_equal(found, expected)
