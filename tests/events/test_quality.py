"""Quality of recordings whose faults are known: those of the simulated readout, of hot and dead pixels, of flicker."""

import re
from functools import cache

import numpy as np
import pytest

from evslip.events import EventCamera, Events, concatenate
from evslip.events.quality.findings import described, harms
from evslip.events.quality.quality import Quality, QualityMeter
from evslip.events.stream import BURST

SIZE = (64, 48)


def poisson(rate_hz: float, seconds: float, seed: int = 0, size: tuple[int, int] = SIZE, on: float = 0.5) -> Events:
    rng = np.random.default_rng(seed)
    count = rng.poisson(rate_hz * seconds)
    t_us = np.sort(rng.integers(0, round(seconds * 1e6), count))
    x, y = (rng.integers(0, side, count).astype(np.uint16) for side in size)
    return Events(t_us, x, y, rng.random(count) < on)


def merged(*streams: Events) -> Events:
    events = concatenate(streams)
    return events.select(np.argsort(events.t_us, kind="stable"))


def quality(events: Events, size: tuple[int, int] = SIZE, pieces: int = 7) -> Quality:
    meter = QualityMeter(size)
    for part in np.array_split(np.arange(events.count), pieces):
        meter.add(events.select(part))
    return meter.quality()


def steady(t_s: float) -> float:
    return 1.0


def filmed(seconds: float, light=steady, still: bool = False, readout=None, **camera) -> Events:
    """Events of a grating that moves to and fro, or stands, below a lamp."""
    faults = tuple((readout or {}).items())
    return _filmed(seconds, light, still, faults, tuple(camera.items()))


@cache
def _filmed(seconds: float, light, still: bool, readout: tuple, camera: tuple) -> Events:
    settings: dict = {"preset": "clean", "size": SIZE, "cutoff_hz": 300.0, "seed": 1} | dict(camera)
    eye = EventCamera(**settings, readout=dict(readout))
    x, y = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
    times = np.arange(0.0, seconds, 5e-4)

    def frame(t_s: float) -> np.ndarray:
        shift = 0.0 if still else 3.0 * np.sin(2 * np.pi * 1.3 * t_s)
        return light(t_s) * (0.5 + 0.3 * np.sin(0.5 * (x + shift)) * np.cos(0.4 * y))

    events = eye.run((t_s * 1e6, frame(t_s)) for t_s in times)
    return merged(events, eye.waiting())


def test_noise_alone_has_no_fault_and_parts_do_not_matter():
    events = poisson(200_000, 4.0)
    found = quality(events)
    assert found.saturation is None and found.losses.number == 0 and found.flashes.number == 0
    assert found.row_bursts.number == found.column_bursts.number == 0
    assert found.pixels is not None and not len(found.pixels.hot) and not len(found.pixels.dead)
    assert found.pixels.judged == SIZE[0] * SIZE[1]
    assert found.flicker is not None and found.flicker.cause == "none"
    assert found.drift is not None and not found.drift.is_certain
    assert harms(found) == []
    assert quality(events, pieces=1).as_json() == quality(events, pieces=101).as_json() == found.as_json()


@pytest.mark.parametrize("seed", range(6))
def test_false_alarms_are_rare(seed: int):
    rng = np.random.default_rng(seed)
    rate = np.exp(rng.uniform(8, 13))
    found = quality(poisson(rate, rng.uniform(0.3, 3), seed, on=rng.uniform(0.3, 0.7)))
    assert harms(found) == [], described(found)


@pytest.mark.parametrize("limit_hz", [45_000.0, 50_000.0])
def test_a_full_bus_is_seen_with_its_rate_and_time(limit_hz: float):
    tight = filmed(1.0, preset="noisy", readout={"bus_rate_hz": limit_hz, "buffer_events": 300})
    gaps = np.diff(tight.t_us, prepend=tight.t_us[0])
    slack = tight.t_us[gaps > 1e6 / limit_hz + 1.5] // 500  # steps in which the bus had a rest
    full = np.setdiff1d(np.unique(tight.t_us // 500), slack)
    found = quality(tight).saturation
    assert quality(filmed(1.0, preset="noisy")).saturation is None
    assert found is not None and found.of == "events"
    assert found.limit_hz == pytest.approx(limit_hz, rel=0.05)
    assert len(full) > 50 and found.share == pytest.approx(len(full) / 2000, abs=0.05)
    assert any("readout.bus_rate_hz" in line for line in harms(quality(tight)))


def test_gaps_with_sharp_ends_are_losses_and_pauses_are_not():
    events = poisson(100_000, 3.0)
    gaps = [(0.5, 0.003), (1.2, 0.05), (2.0, 0.0101)]
    kept = np.ones(events.count, bool)
    for begin, length in gaps:
        kept &= ~((events.t_us >= begin * 1e6) & (events.t_us < (begin + length) * 1e6))
    found = quality(events.select(kept)).losses
    assert found.number == 3
    assert found.seconds == pytest.approx(0.0631, abs=0.003)
    assert found.events == pytest.approx(6310, rel=0.15)
    assert found.longest[0] == pytest.approx((1.2, 0.05), abs=1e-3)
    slowing = events.select(np.abs(events.t_us / 1e6 - 1.5) > 0.3)
    quiet = merged(slowing, poisson(200, 3.0, seed=4))  # nothing moves for a while
    assert quality(quiet).losses.number == 0


@pytest.mark.parametrize(("key", "field"), [("row_bursts_hz", "row_bursts"), ("column_bursts_hz", "column_bursts")])
def test_bursts_of_lines_are_counted(key: str, field: str):
    events = filmed(2.0, readout={key: 8.0})
    assert events.cause is not None
    made = int((events.cause == BURST).sum()) / (SIZE[0] if key.startswith("row") else SIZE[1])
    found = quality(events)
    assert getattr(found, field).number == pytest.approx(made, abs=max(2, 0.15 * made))
    other = "column_bursts" if field == "row_bursts" else "row_bursts"
    assert getattr(found, other).number == 0
    assert quality(filmed(2.0)).row_bursts.number == quality(filmed(2.0)).column_bursts.number == 0
    assert any(f"readout.{key}" in line for line in harms(found))


def test_bursts_of_pixels_anywhere_are_counted():
    events = filmed(2.0, readout={"pixel_bursts_hz": 6.0, "burst_events": 2000})
    assert events.cause is not None
    number = int((events.cause == BURST).sum()) / 2000
    assert number > 5
    assert quality(events).flashes.number == pytest.approx(number, abs=max(1, 0.1 * number))
    assert quality(filmed(2.0)).flashes.number == 0


def test_hot_and_dead_pixels_are_found_where_they_are():
    rng = np.random.default_rng(5)
    places = rng.choice(SIZE[0] * SIZE[1], 12, replace=False)
    hot, dead = [(int(k % SIZE[0]), int(k // SIZE[0])) for k in places[:6]], places[6:]
    own = merged(filmed(2.0).replace(body=None, cause=None), poisson(20.0 * SIZE[0] * SIZE[1], 2.0))
    kept = ~np.isin(own.y.astype(int) * SIZE[0] + own.x, dead)
    streams = [own.select(kept)]
    for number, (x, y) in enumerate(hot):
        fires = poisson(1600.0, 2.0, seed=100 + number)
        streams.append(fires.replace(x=np.full_like(fires.x, x), y=np.full_like(fires.y, y)))
    found = quality(merged(*streams)).pixels
    assert found is not None
    assert sorted(map(tuple, found.hot.tolist())) == sorted(hot)
    assert sorted(map(tuple, found.dead.tolist())) == sorted((int(k % SIZE[0]), int(k // SIZE[0])) for k in dead)
    assert found.hot_events == pytest.approx(6 * 3200, rel=0.2)


@pytest.mark.parametrize("frequency_hz", [60.0, 100.0, 120.0, 173.3, 400.0])
@pytest.mark.parametrize("still", [True, False])
def test_the_lamps_frequency_is_found(frequency_hz: float, still: bool):
    def light(t_s: float) -> float:
        phase = 2 * np.pi * frequency_hz * t_s
        return 1.0 + 0.3 * np.sin(phase) + 0.06 * np.sin(2 * phase)

    found = quality(filmed(2.0, light, still, theta=0.1)).flicker
    assert found is not None and found.cause == "lamp"
    assert found.frequency_hz == pytest.approx(frequency_hz, abs=found.resolution_hz + 0.3)
    assert found.blocks > 10 and found.false_alarm < 1e-9


def test_a_part_that_shakes_is_not_a_lamp():
    """One corner of the picture trembles at 90 Hz."""
    eye = EventCamera("clean", size=SIZE, cutoff_hz=300.0)
    x, y = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
    corner = (x < 16) & (y < 12)

    def frame(t_s: float) -> np.ndarray:
        shift = 0.8 * np.sin(2 * np.pi * 90 * t_s) * corner
        return 0.5 + 0.4 * np.sin(0.7 * (x + shift) + 1.0)

    found = quality(eye.run((t_s * 1e6, frame(t_s)) for t_s in np.arange(0, 2, 5e-4))).flicker
    assert found is not None and found.cause != "lamp"


@pytest.mark.parametrize("change", [0.0, 0.3, -0.2])
def test_a_drift_of_the_on_threshold_shows_in_the_ratio(change: float):
    """ON events by a threshold that grows, in a scene whose rate goes up and down."""
    rng = np.random.default_rng(3)
    seconds, count = 60.0, 400_000
    t = np.sort(rng.uniform(0, seconds, count))
    t = t[rng.random(count) < 0.2 + 0.8 * np.sin(2 * np.pi * t / 17) ** 2]
    odds = np.exp(change * t / seconds)
    x, y = (rng.integers(0, side, len(t)).astype(np.uint16) for side in SIZE)
    events = Events((t * 1e6).astype(np.int64), x, y, rng.random(len(t)) < odds / (1 + odds))
    found = quality(events)
    assert found.drift is not None
    assert found.drift.is_certain == bool(change)
    assert found.drift.change == pytest.approx(change, abs=max(0.02, 4 * found.drift.error))
    assert any(line.startswith("drift") for line in harms(found)) == bool(change)


def test_one_polarity_alone_hurts():
    (line,) = harms(quality(poisson(100_000, 1.0, on=0.97)))
    assert line.startswith("polarity: 97% of the events are ON") and "OFF threshold" in line
    assert harms(quality(poisson(100_000, 1.0, on=0.8))) == []


def test_hot_pixels_hurt_where_they_matter_in_a_quiet_window():
    def with_hot_pixel(rate_hz: float) -> Events:
        hot = poisson(800.0, 4.0, seed=9)
        return merged(poisson(rate_hz, 4.0), hot.replace(x=np.full_like(hot.x, 5), y=np.full_like(hot.y, 7)))

    for rate_hz, hurts in ((10_000.0, True), (200_000.0, False)):
        events = with_hot_pixel(rate_hz)
        found = quality(events)
        assert found.pixels is not None and found.pixels.hot.tolist() == [[5, 7]]
        counts = np.bincount(events.t_us // 160_000)[:-1]
        assert found.quiet_hz == pytest.approx(np.percentile(counts, 10) / 0.16, rel=0.03)
        assert any(re.match(r"hot pixels: 1[123]\d events", line) for line in harms(found)) == hurts


def test_a_short_recording_has_no_drift_to_tell():
    events = poisson(100_000, 4.0)
    rising = events.replace(p=np.random.default_rng(0).random(events.count) < 0.3 + 0.1 * events.t_us / 1e6)
    found = quality(rising)
    assert found.drift is not None and found.drift.is_certain and harms(found) == []
    assert "motion changes it, too" in described(found)["drift"]


def test_the_clocks_step_is_told():
    events = poisson(100_000, 1.0)
    assert described(quality(events))["clock"] == "times in steps of 1 us"
    assert "1,000 us" in described(quality(events.replace(t_us=events.t_us // 1000 * 1000)))["clock"]


def test_short_empty_and_disordered_streams_are_told():
    nothing = QualityMeter(SIZE).quality()
    assert described(nothing) == {} and harms(nothing) == []
    few = quality(poisson(1000, 0.01), pieces=2)
    assert few.flicker is None and few.drift is None
    assert "not judged" in described(few)["flicker"]
    wild = Events(np.array([10**15, 3, 2**61, 0]), *(np.zeros(4, np.uint16),) * 2, np.ones(4, bool))
    assert quality(wild, pieces=2).count == 4
    beyond = poisson(1000, 0.1, size=(100, 100))
    inside = (beyond.x < SIZE[0]) & (beyond.y < SIZE[1])
    assert quality(beyond).count == int(inside.sum())
    huge = quality(poisson(1000, 0.1), size=(65535, 65535))
    assert huge.pixels is None and "too large" in described(huge)["hot"]
