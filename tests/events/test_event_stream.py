import copy
import pickle

import numpy as np
import pytest

from evslip.events import Events, concatenate, empty_events
from evslip.events.stream import FIELDS, Event
from evslip.utils.errors import ConfigError, DataError
from evslip.windows.window_events import WindowEvents
from sample_records import assert_equal, random_events


@pytest.fixture
def events() -> Events:
    return random_events(np.random.default_rng(0), 500)


def test_length_and_single_events(events):
    assert len(events) == events.count == 500
    assert events[3] == Event(int(events.t_us[3]), int(events.x[3]), int(events.y[3]), bool(events.p[3]))
    assert events[np.int64(-1)] == events[499]
    with pytest.raises(IndexError):
        events[500]
    assert not empty_events()


def test_slices_are_views_and_masks_and_indices_pick(events):
    part = events[10:20]
    assert_equal(part, events.select(slice(10, 20)))
    assert all(np.shares_memory(getattr(part, name), getattr(events, name)) for name in FIELDS)
    assert_equal(events[events.p], events.select(np.flatnonzero(events.p)))
    assert_equal(events[[4, 2, -1]], events.select(np.array([4, 2, 499])))
    assert len(events[[]]) == 0
    with pytest.raises(IndexError):
        events[np.ones(3, bool)]


def test_chunks_are_the_whole(events):
    by_number = list(events.chunks(64))
    assert [len(part) for part in by_number] == [64] * 7 + [52]
    assert_equal(concatenate(by_number), events)
    spread = events.replace(t_us=np.sort(np.random.default_rng(1).integers(-9000, 90_000, 500)))
    by_time = list(spread.chunks(duration_us=100))
    assert_equal(concatenate(by_time), spread)
    assert any(not len(part) for part in by_time)
    first = int(spread.t_us[0])
    for number, part in enumerate(by_time):
        assert ((part.t_us - first) // 100 == number).all()
    assert list(empty_events().chunks(10)) == list(empty_events().chunks(duration_us=10)) == []


@pytest.mark.parametrize("how", [{}, {"number": 0}, {"duration_us": -1}, {"number": 1, "duration_us": 1}])
def test_chunks_of_nothing_are_refused(events, how):
    with pytest.raises(ConfigError, match="expected one of them"):
        events.chunks(**how)


def test_unpacking_says_what_to_do(events):
    for wrong in (
        lambda: (lambda t, x, y, p: t)(*events),
        lambda: list(events),
        lambda: list(zip(*events, strict=True)),
    ):
        with pytest.raises(TypeError, match=r"events\.columns.*events\.chunks.*to_structured"):
            wrong()
    t_us, x, y, p = events.columns
    assert t_us is events.t_us and x is events.x and y is events.y and p is events.p


def test_nothing_can_be_set(events):
    with pytest.raises(AttributeError):
        events.x = events.y
    with pytest.raises(TypeError):
        hash(events)


@pytest.mark.parametrize("kind", [Events, WindowEvents])
@pytest.mark.parametrize("layout", ["tonic", "dv"])
def test_structured_arrays_there_and_back(events, layout, kind):
    rows = kind(*events.columns).to_structured(layout)
    assert rows.shape == (500,)
    assert_equal(Events.from_structured(rows), Events(*events.columns))
    assert_equal(
        Events.from_structured(rows[["y", *(n for n in rows.dtype.names if n != "y")]]), Events(*events.columns)
    )


def test_the_layouts_are_those_of_the_packages(events):
    # tonic.io.events_struct, and EventStore.numpy() of dv-processing 2.0.
    assert np.asarray(events).dtype == np.dtype([("x", "<i2"), ("y", "<i2"), ("t", "<i8"), ("p", "?")])
    rows = events.to_structured("dv")
    assert rows.dtype.names == ("timestamp", "x", "y", "polarity") and rows.dtype.itemsize == 16
    assert set(rows["polarity"].tolist()) == {0, 1}


def test_signs_as_polarity_are_read():
    rows = np.array([(1, 2, 3, -1), (4, 5, 6, 1)], [("ts", "i4"), ("x", "u1"), ("y", "u1"), ("pol", "i1")])
    assert Events.from_structured(rows).p.tolist() == [False, True]


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (np.zeros(3), "lacks t_us, x, y, p"),
        (np.zeros(3, [("t", "i8"), ("x", "i2"), ("y", "i2")]), "fields t, x, y: lacks p"),
        (np.zeros((3, 1), [("t", "i8"), ("x", "i2"), ("y", "i2"), ("p", "?")]), r"shape \(3, 1\)"),
        (np.zeros(3, [("t", "f8"), ("x", "i2"), ("y", "i2"), ("p", "?")]), "whole numbers, times in microseconds"),
        (np.array([(1, -1, 0, 0)], [("t", "i8"), ("x", "i2"), ("y", "i2"), ("p", "?")]), "events/x: -1"),
        (np.array([(2, 0, 0, 0), (1, 0, 0, 0)], [("t", "i8"), ("x", "i2"), ("y", "i2"), ("p", "?")]), "never decrease"),
        (np.array([(2**63 + 1, 0, 0, 0)], [("t", "u8"), ("x", "i2"), ("y", "i2"), ("p", "?")]), "events/t_us: .* to"),
        (np.array([(1, 0, 0, np.nan)], [("t", "i8"), ("x", "i2"), ("y", "i2"), ("p", "f4")]), "events/p: float32"),
        (np.array([(1, 0, 0, "1")], [("t", "i8"), ("x", "i2"), ("y", "i2"), ("p", "S1")]), "events/p: .S1"),
        ([(1, 0, 0, 0)], "list: expected a structured NumPy array"),
    ],
)
def test_arrays_that_hold_no_events_are_refused(rows, message):
    with pytest.raises(DataError, match=message):
        Events.from_structured(rows)


def test_pixels_beyond_int16_and_unknown_layouts_are_refused(events):
    with pytest.raises(DataError, match=r"events/x: 40000 .* at most 32767"):
        events.replace(x=np.full(500, 40_000, np.uint16)).to_structured()
    with pytest.raises(ConfigError, match="tonic, dv"):
        events.to_structured("pandas")


def test_equality_is_that_of_the_content(events):
    assert events == events.select(np.arange(500)) == copy.deepcopy(events) == pickle.loads(pickle.dumps(events))
    assert events != events[:-1] and events != events.replace(p=~events.p)
    assert events != Events(*events.columns)
    assert Events(*events.columns) == WindowEvents(*events.columns)
    assert events != "events" and empty_events() == empty_events() != empty_events(labelled=True)


def test_the_repr_says_what_there_is():
    x, y = np.array([7, 339], np.uint16), np.array([200, 3], np.uint16)
    events = Events(np.array([1_500, 2_000_000]), x, y, np.array([True, False]), cause=np.zeros(2, np.uint8))
    assert repr(events) == (
        "<Events: 2 events, 1 ON, 1 OFF, 0.001500 to 2.000000 s, within 340x201 pixels, with cause>"
    )
    assert repr(empty_events()) == "<Events: 0 events, 0 ON, 0 OFF>"
