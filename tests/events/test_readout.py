"""Stages of the readout against what is known of them, and what holds for all."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evslip.events import Events, Readout
from evslip.events.readout.sensor_readout import SensorReadout
from evslip.events.readout.settings import READOUT_LIMITS, with_changes
from evslip.events.stream import BURST, CAUSES, SIGNAL, concatenate
from evslip.utils.errors import ConfigError

SHAPE = (24, 32)
KINDS: dict[str, dict[str, float]] = {
    "frames": {"frame_us": 197.3, "scan_us": -192.0},
    "frames at once": {"frame_us": 50.0},
    "rows": {"row_us": 3.7, "event_us": 0.9},
    "bus": {"bus_rate_hz": 130e3, "buffer_events": 40},
    "losses": {"lost_share": 0.3},
    "bursts": {"row_bursts_hz": 200.0, "column_bursts_hz": 200.0, "pixel_bursts_hz": 300.0, "burst_events": 30},
    "jumps": {"jumps_hz": 150.0},
    "jumps back": {"jumps_hz": 150.0, "jump_us": -700.0, "clock_us": 10.0},
    "all, rows": {"row_us": 3.7, "bus_rate_hz": 130e3, "lost_share": 0.1, "pixel_bursts_hz": 300.0, "jumps_hz": 150.0},
    "all, frames": {"frame_us": 197.3, "scan_us": 90.0, "bus_rate_hz": 2e5, "row_bursts_hz": 99.0, "jumps_hz": 150.0},
}


def random_events(count: int, span_us: float, seed: int = 0, shape: tuple[int, int] = SHAPE) -> Events:
    """Events at random times in random pixels."""
    rng = np.random.default_rng(seed)
    t_us = np.sort(rng.integers(0, round(span_us), count))
    x, y = (rng.integers(0, size, count).astype(np.uint16) for size in shape[::-1])
    cause = np.full(count, SIGNAL, np.uint8)
    return Events(t_us, x, y, rng.random(count) < 0.6, rng.integers(0, 4, count).astype(np.uint8), cause)


def whole(events: Events, shape: tuple[int, int] = SHAPE, seed: int = 5, **parameters: Any) -> tuple[Events, Any]:
    """All that comes out, however late, and the counts before the last of it did."""
    readout = SensorReadout(with_changes(Readout(), parameters), shape, seed)
    readout.begin(0.0)
    out = readout.read(events, int(events.t_us[-1]) + 1)
    return concatenate([out, readout.waiting()]), readout.counts


def pixel_of(events: Events) -> np.ndarray:
    return events.y.astype(np.int64) * 65536 + events.x


@pytest.mark.parametrize("load", [0.3, 0.6, 0.8])
def test_a_bus_waits_as_the_queue_with_one_fixed_service_time_does(load: float):
    service_us, count = 100.0, 400_000
    rng = np.random.default_rng(1)
    t_us = np.cumsum(rng.exponential(service_us / load, count)).astype(np.int64)
    events = random_events(count, 1e6).replace(t_us=t_us)
    out, counts = whole(events, bus_rate_hz=1e6 / service_us, buffer_events=1e6)
    wait_us = load * service_us / (2 * (1 - load))  # Pollaczek and Khinchine
    assert np.mean(out.t_us - t_us) == pytest.approx(wait_us, rel=0.05)
    assert counts.lost == 0 and out.count == count


@pytest.mark.parametrize(("load", "buffer"), [(0.8, 2), (1.5, 3), (1.0, 0)])
def test_a_buffer_overflows_as_often_as_the_queue_with_so_many_places(load: float, buffer: int):
    service_us, count = 1000.0, 200_000
    rng = np.random.default_rng(2)
    t_us = np.cumsum(rng.exponential(service_us / load, count)).astype(np.int64)
    _, counts = whole(random_events(count, 1e6).replace(t_us=t_us), bus_rate_hz=1e3, buffer_events=buffer)
    # Left behind by a departure: a Markov chain, Poisson arrivals during a service; then the share that finds a place.
    places = buffer + 1
    arrivals = [math.exp(-load) * load**k / math.factorial(k) for k in range(places)]
    chain = np.zeros((places, places))
    for left in range(places):
        base = max(left - 1, 0)
        for k in range(places - base):
            chain[left, base + k] = arrivals[k]
        chain[left, -1] += 1 - chain[left].sum()
    empty = np.linalg.matrix_power(chain, 4000)[0, 0]
    assert sum(counts.overflowed) / count == pytest.approx(1 - 1 / (empty + load), abs=0.006)


def test_an_arbiter_that_rarely_finds_two_events_in_a_row_waits_as_the_same_queue():
    row_us, load, count, shape = 80.0, 0.6, 100_000, (20_000, 4)
    t_us = np.cumsum(np.random.default_rng(3).exponential(row_us / load, count)).astype(np.int64)
    events = random_events(count, 1e6, shape=shape).replace(t_us=t_us)
    _, counts = whole(events, shape, row_us=row_us)
    assert counts.lost < 0.001 * count
    assert counts.mean_delay_us == pytest.approx(load * row_us / (2 * (1 - load)), rel=0.05)


def test_an_arbiter_reads_a_row_at_one_time_and_takes_its_time():
    t_us, y, x = np.array([0, 1, 2, 3, 4]), np.array([7, 9, 7, 9, 2]), np.array([1, 2, 3, 2, 5])
    events = random_events(5, 10).replace(t_us=t_us, y=y.astype(np.uint16), x=x.astype(np.uint16))
    out, counts = whole(events, row_us=10.0, event_us=2.0)
    # Row 7 at once; row 9 then, whose pixel could not fire again; row 7 once more, which came before row 2.
    assert list(zip(out.t_us.tolist(), out.y.tolist(), out.x.tolist(), strict=True)) == [
        (0, 7, 1),
        (12, 9, 2),
        (24, 7, 3),
        (36, 2, 5),
    ]
    assert sum(counts.blocked) == 1


def test_an_arbiter_under_load_reads_many_events_of_a_row_together():
    out, counts = whole(random_events(20_000, 20_000), row_us=5.0)
    stamps, rows = np.unique(out.t_us * 100 + out.y).size, np.unique(out.t_us).size
    assert stamps == rows == pytest.approx(20_000 / 5.0, rel=0.01)
    assert sum(counts.blocked) > 0


def test_event_frames_share_time_stamps_by_column_and_hold_one_event_a_pixel():
    frame_us, scan_us = 197.3, -192.0
    events = random_events(60_000, 100_000)
    out, counts = whole(events, frame_us=frame_us, scan_us=scan_us)
    lag_us = (SHAPE[1] - 1 - out.x.astype(float)) * 192.0 / SHAPE[1]
    frame = np.round((out.t_us - lag_us) / frame_us)
    late_us = out.t_us - (frame * frame_us + lag_us)
    assert late_us.min() > -1.0 - 1e-6 and late_us.max() <= 1e-6  # rounded down
    assert len(np.unique(frame * 2**32 + pixel_of(out))) == out.count
    assert out.count + sum(counts.blocked) == events.count and sum(counts.blocked) > 0


def test_event_frames_lose_what_a_poisson_process_fires_twice():
    frame_us, mean = 200.0, 0.5
    events = random_events(round(mean * 768 * 500), 500 * frame_us)
    out, _ = whole(events, frame_us=frame_us)
    assert out.count / (768 * 500) == pytest.approx(1 - math.exp(-mean), rel=0.01)


def test_losses_hit_every_event_alike():
    events = random_events(100_000, 1e6)
    out, counts = whole(events, lost_share=0.3)
    assert out.count / events.count == pytest.approx(0.7, abs=0.006)
    assert np.mean(out.p) == pytest.approx(np.mean(events.p), abs=0.006)
    assert counts.dropped[1] == np.count_nonzero(events.p) - np.count_nonzero(out.p)


def test_bursts_come_as_often_as_said_with_their_cause_and_one_polarity():
    out, counts = whole(random_events(1000, 20e6), row_bursts_hz=5.0, column_bursts_hz=5.0, burst_us=300.0)
    burst = out.select(out.cause == BURST)
    assert burst.count == sum(counts.added) and CAUSES[BURST] == "burst"
    assert burst.count == pytest.approx(5 * 20 * (SHAPE[0] + SHAPE[1]), rel=0.3)  # 100 bursts of a kind, give or take
    assert out.count - burst.count == 1000
    gaps = np.flatnonzero(np.diff(burst.t_us) > 2000)
    alone = [part for part in np.split(np.arange(burst.count), gaps + 1) if len(part) in SHAPE]
    assert len(alone) > 50
    for part in alone:
        one = burst.select(part)
        assert np.ptp(one.t_us) <= 300 and len(np.unique(one.p)) == 1
        assert len(np.unique(one.x)) == 1 or len(np.unique(one.y)) == 1


@pytest.mark.parametrize("jump_us", [1000.0, -1000.0])
def test_a_clock_that_jumps_repeats_one_time_and_is_right_again(jump_us: float):
    events = random_events(200_000, 10e6)
    out, _ = whole(events, jumps_hz=5.0, jump_us=jump_us)
    off = out.t_us - events.t_us
    values, counts = np.unique(out.t_us[off != 0], return_counts=True)
    assert len(values) == pytest.approx(50, abs=25)
    assert counts.mean() == pytest.approx(20, rel=0.1)  # events in a millisecond
    assert off.min() >= min(jump_us, 0) - 1 and off.max() <= max(jump_us, 0) + 1
    assert np.ptp(off) == pytest.approx(1000, abs=60)


def test_a_clock_has_a_resolution():
    events = random_events(1000, 1e6)
    out, _ = whole(events, clock_us=1000.0)
    np.testing.assert_array_equal(out.t_us, events.t_us // 1000 * 1000)


@pytest.mark.parametrize("parameters", KINDS.values(), ids=list(KINDS))
def test_the_readout_does_not_depend_on_where_calls_cut(parameters: dict[str, float]):
    events = random_events(6000, 40_000)
    once, _ = whole(events, **parameters)
    for cuts in ([13_000], list(range(37, 40_000, 613)), [2, 3, 5, 39_990]):
        readout = SensorReadout(with_changes(Readout(), parameters), SHAPE, 5)
        readout.begin(0.0)
        parts, first = [], 0
        for until in [*cuts, int(events.t_us[-1]) + 1]:
            # Events of a frame's own time come with it.
            last = int(np.searchsorted(events.t_us, until, side="right"))
            parts.append(readout.read(events.select(slice(first, last)), until))
            first = last
        assert concatenate([*parts, readout.waiting()]) == once


@settings(max_examples=60, deadline=None)
@given(
    kind=st.sampled_from(sorted(KINDS)),
    count=st.integers(1, 400),
    span_us=st.integers(1, 5000),
    cut=st.floats(0, 1),
    seed=st.integers(0, 2**32),
)
def test_order_and_number_are_kept(kind: str, count: int, span_us: int, cut: float, seed: int):
    events = random_events(count, span_us, seed, shape=(4, 5))
    readout = SensorReadout(with_changes(Readout(), KINDS[kind]), (4, 5), seed)
    readout.begin(0.0)
    middle = round(cut * count)
    until = int(events.t_us[middle]) if middle < count else span_us
    halves = events.select(slice(middle)), events.select(slice(middle, None))
    parts = [readout.read(half, end) for half, end in zip(halves, (until, span_us), strict=True)]
    counts, waiting = readout.counts, readout.waiting()
    out = concatenate([*parts, waiting])
    assert np.all(np.diff(out.t_us) >= 0)
    assert all(part.count == 0 or part.t_us[-1] <= end for part, end in zip(parts, (until, span_us), strict=True))
    for polarity in (0, 1):
        came = counts.offered[polarity] + counts.added[polarity]
        went = counts.blocked[polarity] + counts.overflowed[polarity] + counts.dropped[polarity]
        assert came == counts.read[polarity] + went + counts.waiting[polarity]
    assert sum(counts.offered) == count and sum(counts.read) == sum(part.count for part in parts)
    assert counts.waiting >= (0, 0) and sum(counts.waiting) >= waiting.count
    # Every event that comes out is one that went in, or of a burst.
    offered = set(zip(pixel_of(events).tolist(), events.p.tolist(), events.body.tolist(), strict=True))  # pyright: ignore[reportOptionalMemberAccess]
    real = out.select(out.cause != BURST)
    assert set(zip(pixel_of(real).tolist(), real.p.tolist(), real.body.tolist(), strict=True)) <= offered  # pyright: ignore[reportOptionalMemberAccess]


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"frame": 3.0}, "readout.frame: unknown parameter"),
        ({"frame_us": -1.0}, "readout.frame_us: -1.0 is out of range"),
        ({"lost_share": "much"}, "readout.lost_share: 'much' is not a number"),
        ({"lost_share": float("nan")}, "readout.lost_share: nan is out of range"),
        ({"bus_rate_hz": 1e-13}, "readout.bus_rate_hz: 1e-13 is out of range, expected 0, or 1 or more"),
        ({"frame_us": 0.5}, "readout.frame_us: 0.5 is out of range, expected 0, or 1 or more"),
        ({"frame_us": 10.0, "row_us": 1.0}, "readout.frame_us: event frames have no arbiter"),
        ({"frame_us": 10.0, "scan_us": -11.0}, "readout.scan_us: -11 takes longer than a frame"),
        ({"scan_us": 11.0}, "readout.scan_us: 11 takes longer than a frame"),
        (3.0, "readout: 3.0 is wrong"),
    ],
)
def test_a_wrong_readout_is_named(parameters: Any, message: str):
    with pytest.raises(ConfigError, match=message):
        with_changes(Readout(), parameters)


def test_every_parameter_is_off_by_default_and_within_its_limits():
    assert not Readout().is_on
    for name, (low, high) in READOUT_LIMITS.items():
        assert low <= getattr(Readout(), name) <= high
