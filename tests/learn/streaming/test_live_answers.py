"""Answers to a live stream are those to the whole recording."""

import time

import numpy as np
import pytest

from evslip.events.stream import Events
from evslip.exchange.live.feed import Feed
from evslip.exchange.live.source import Ended, LiveSource, Piece
from evslip.learn.streaming.live import Answered, LiveDetector, Note, Status
from evslip.learn.streaming.stream import Detector, detect

SIZE = (346, 260)


class Given(LiveSource):
    """A source of pieces that come at once, or as slowly as asked for."""

    name = "given"

    def __init__(self, pieces: list[Piece], pause_s: float = 0.0):
        self._pieces, self._pause_s = iter(pieces), pause_s

    @property
    def size(self):
        return SIZE

    def open(self):
        pass

    def close(self):
        pass

    def read(self, timeout_s):
        time.sleep(self._pause_s)
        piece = next(self._pieces, None)
        if piece is None:
            raise Ended
        return piece


def some_events(count: int, seconds: float) -> Events:
    rng = np.random.default_rng(0)
    t_us = np.sort(rng.integers(0, int(seconds * 1e6), count))
    return Events(t_us, rng.integers(0, 346, count, np.uint16), rng.integers(0, 260, count, np.uint16), t_us % 2 == 0)


def test_slow_enough_every_answer_is_given_as_offline():
    events = some_events(30_000, 0.3)
    pieces = [Piece(part, 0.0) for part in events.chunks(duration_us=20_000)]
    live = LiveDetector(Feed(Given(pieces, 0.15)), lambda size: Detector("default", size=size, hop_s=0.02))
    reports = run(live)
    found = [one.detection for one in reports if isinstance(one, Answered)]
    expected = detect("default", events, SIZE, hop_s=0.02)
    assert np.array_equal(np.concatenate([one.t_us for one in found]), expected.t_us)
    assert np.allclose(np.concatenate([one.p_slip for one in found]), expected.p_slip, atol=1e-5)
    final = reports[-1]
    assert isinstance(final, Status) and final.final
    assert (final.counters.skipped, final.counters.dropped) == (0, 0)
    assert final.counters.answers == len(expected.t_us)


def test_under_overload_the_newest_is_answered_and_the_rest_counted():
    events = some_events(30_000, 1.0)
    feed = Feed(Given([Piece(part, 0.0) for part in events.chunks(duration_us=20_000)]))
    reports = run(LiveDetector(feed, lambda size: Detector("default", size=size, hop_s=0.001)))
    ends = np.concatenate([one.detection.t_us for one in reports if isinstance(one, Answered)])
    counters = reports[-1].counters
    assert 0 < len(ends) < 840 and ends[-1] > 950_000
    first_us = int(events.t_us[0]) + 160_000
    assert len(ends) == counters.answers
    assert counters.answers + counters.skipped == (ends[-1] - first_us) // 1000 + 1
    assert counters.received == 30_000


@pytest.mark.parametrize("name", ["restart"])
def test_after_a_restart_a_detector_answers_as_a_new_one(name):
    events = some_events(20_000, 0.3)
    detector = Detector("default", hop_s=0.02)
    detector.follow(events.replace(t_us=events.t_us + 10**9))
    getattr(detector, name)()
    assert np.array_equal(detector.follow(events).p_slip, Detector("default", hop_s=0.02).follow(events).p_slip)


class Changing(Given):
    """A source whose sensor changes while the pieces before still wait."""

    size = SIZE

    def read(self, timeout_s):
        piece = super().read(timeout_s)
        self.size = (int(piece.events.x.max()) + 1, int(piece.events.y.max()) + 1)
        return piece


def test_pieces_of_a_sensor_before_the_present_one_are_answered_for_theirs():
    large = some_events(20_000, 0.3)
    small = large.replace(t_us=large.t_us + 20_000_000, x=large.x % 64, y=large.y % 48)
    sizes = []

    def make(size):
        sizes.append(size)
        return Detector("default", size=size, align="centre", hop_s=0.02)

    live = LiveDetector(Feed(Changing([Piece(large, 0.0), Piece(small, 0.0)])), make)
    live._feed.start()
    live._feed._thread.join()  # both pieces wait
    found = list(live.reports())
    assert sizes == [(346, 260), (64, 48)]
    assert [len(one.detection.t_us) > 0 for one in found if isinstance(one, Answered)] == [True, True]
    assert any(isinstance(one, Note) and "size is now (64, 48)" in one.text for one in found)


def run(live: LiveDetector) -> list:
    live._feed.start()
    return list(live.reports())
