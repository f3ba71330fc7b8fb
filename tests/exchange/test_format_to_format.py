from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from command_line import evslip
from evslip import codecs
from evslip.codecs import read_events, write_events
from evslip.codecs.facts import examine
from evslip.data import record_file
from evslip.data.record_file import read_recording
from evslip.events.stream import FIELDS
from evslip.exchange.format_to_format import convert_format
from evslip.exchange.importing.recordings import import_recording
from evslip.exchange.selection import Selection
from evslip.exchange.selector import Selector
from evslip.utils.errors import ConfigError, DataError
from foreign_files import Camera, aedat4
from sample_records import assert_equal, random_events, simulated

WRITABLE = codecs.known_suffixes(writing=True)


@pytest.mark.parametrize("suffix", WRITABLE)
def test_any_format_becomes_any_other_and_comes_back(tmp_path: Path, suffix: str):
    events = random_events(np.random.default_rng(0), 200, labelled=False)
    write_events(tmp_path / "a.h5", events, (40, 30))
    for target in WRITABLE:
        convert_format(tmp_path / "a.h5", tmp_path / f"b{suffix}")
        convert_format(tmp_path / f"b{suffix}", tmp_path / f"c{target}")
        assert_equal(read_events(tmp_path / f"c{target}"), events)


@given(st.integers(0, 2**32), st.integers(0, 39), st.integers(0, 29), st.data())
def test_a_part_is_what_a_loop_would_keep(seed: int, x: int, y: int, data: st.DataObject):
    events = random_events(np.random.default_rng(seed), 60)
    width, height = data.draw(st.integers(1, 40 - x)), data.draw(st.integers(1, 30 - y))
    start, end = sorted(data.draw(st.tuples(st.integers(0, 30), st.integers(31, 60))))
    polarity: Any = data.draw(st.sampled_from(["on", "off", None]))
    from_zero = data.draw(st.booleans())
    selection = Selection((x, y, width, height), (start / 1e3, end / 1e3), polarity, from_zero)
    selector = Selector(selection, (40, 30))
    (kept,) = selector.of([events])
    first = int(events.t_us[0])
    expected = [
        (int(t), int(column) - x, int(row) - y, bool(on), int(body), int(cause))
        for t, column, row, on, body, cause in zip(*(getattr(events, name) for name in FIELDS), strict=True)
        if x <= column < x + width and y <= row < y + height and start * 1000 <= t - first < end * 1000
        if polarity is None or on == (polarity == "on")
    ]
    shift = expected[0][0] if from_zero and expected else 0
    assert [tuple(row) for row in zip(*(getattr(kept, name).tolist() for name in FIELDS), strict=True)] == [
        (t - shift, *rest) for t, *rest in expected
    ]
    assert selector.size == (width, height)


def test_what_is_lost_is_said(tmp_path: Path):
    record_file.write(tmp_path / "a.h5", simulated())
    sample = "all of the sample but its events"
    assert convert_format(tmp_path / "a.h5", tmp_path / "a.npz").lost == (sample,)
    assert convert_format(tmp_path / "a.h5", tmp_path / "a.csv").lost == ("the labels", "the sensor's size", sample)
    assert convert_format(tmp_path / "a.h5", tmp_path / "a.es").lost == ("the labels", sample)
    assert convert_format(tmp_path / "a.es", tmp_path / "a.dat").lost == ()


@pytest.mark.parametrize("images", [0, 2])
def test_frames_are_said_to_be_lost_where_there_are_any(tmp_path: Path, images: int):
    events = random_events(np.random.default_rng(0), 50, labelled=False)
    camera = Camera("L", (40, 30), events, (np.zeros((30, 40), np.uint8),) * images)
    (tmp_path / "a.aedat4").write_bytes(aedat4(camera))
    lost = convert_format(tmp_path / "a.aedat4", tmp_path / "b.aedat4").lost
    assert lost == (("the frames",) if images else ())


def test_times_of_a_clock_are_shifted_on_demand(tmp_path: Path):
    events = random_events(np.random.default_rng(0), 50, labelled=False)
    write_events(tmp_path / "a.npz", events.replace(t_us=events.t_us + 1_605_537_493_718_345), (40, 30))
    with pytest.raises(DataError, match=r"a\.raw: times from .* the format holds 0 to .*--from-zero"):
        convert_format(tmp_path / "a.npz", tmp_path / "a.raw")
    convert_format(tmp_path / "a.npz", tmp_path / "a.raw", Selection(from_zero=True))
    assert_equal(read_events(tmp_path / "a.raw"), events.replace(t_us=events.t_us - events.t_us[0]))


@pytest.mark.parametrize(
    "part",
    [Selection(slice_s=(1, 1)), Selection(slice_s=(-1, 1)), Selection(slice_s=(0, float("nan")))]
    + [Selection(crop=crop) for crop in ((0, 0, 0, 5), (-1, 0, 5, 5), (36, 0, 5, 5), (0, 26, 5, 5))],
)
def test_parts_that_cannot_be_are_refused(tmp_path: Path, part: Selection):
    write_events(tmp_path / "a.npz", random_events(np.random.default_rng(0), 5), (40, 30))
    with pytest.raises(ConfigError, match=r"(slice|crop): .* expected"):
        convert_format(tmp_path / "a.npz", tmp_path / "b.npz", part)
    assert not (tmp_path / "b.npz").exists()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--start-s", -1), "start-s: -1; expected 0 or more"),
        (("--start-s", "nan"), "start-s: nan; expected 0 or more"),
        (("--start-s", 2, "--end-s", 1), "end-s: 1; expected more than the start's 2 s"),
    ],
)
def test_a_start_or_an_end_that_cannot_be_is_named(tmp_path: Path, options: tuple[Any, ...], message: str):
    write_events(tmp_path / "a.npz", random_events(np.random.default_rng(0), 5), (40, 30))
    done = evslip("convert", tmp_path / "a.npz", tmp_path / "b.npz", *options)
    assert (done.returncode, message in done.stderr) == (2, True)
    assert not (tmp_path / "b.npz").exists()


@pytest.mark.parametrize(("end", "span"), [((), "from 5 s on"), (("--end-s", 6), "from 5 to 6 s")])
def test_a_span_without_an_event_is_noted(tmp_path: Path, end: tuple[Any, ...], span: str):
    write_events(tmp_path / "a.npz", random_events(np.random.default_rng(0), 5), (40, 30))
    done = evslip("convert", tmp_path / "a.npz", tmp_path / "b.npz", "--start-s", 5, *end)
    assert done.returncode == 0
    assert f"note: none of the events that are kept is {span} after the first of a.npz" in " ".join(done.stdout.split())


def test_no_events_are_converted_too(tmp_path: Path):
    write_events(tmp_path / "a.npz", random_events(np.random.default_rng(0), 0), (40, 30))
    convert_format(tmp_path / "a.npz", tmp_path / "b.raw", Selection((1, 1, 5, 5), (0, 1), "on", from_zero=True))
    recording = read_recording(tmp_path / "b.raw")
    assert (recording.events.count, recording.size) == (0, (5, 5))


def test_a_file_is_not_converted_onto_itself(tmp_path: Path):
    write_events(tmp_path / "a.npz", random_events(np.random.default_rng(0), 5), (40, 30))
    with pytest.raises(DataError, match="another name"):
        convert_format(tmp_path / "a.npz", tmp_path / "a.npz")


@pytest.mark.parametrize(("name", "value"), [("version", 2), ("kind", "dreamt")])
def test_records_of_another_version_or_kind_are_refused_by_all_who_read_events(tmp_path: Path, name: str, value: Any):
    record_file.write(tmp_path / "a.h5", simulated())
    with h5py.File(tmp_path / "a.h5", "r+") as file:
        file.attrs[name] = value
    readers = (
        read_events,
        codecs.open_events,
        read_recording,
        examine,
        lambda path: convert_format(path, path.with_name("b.csv")),
        lambda path: import_recording(path, path.with_name("c.h5")),
    )
    for reader in readers:
        with pytest.raises(DataError, match=rf"a\.h5: {name} .*{value}"):
            reader(tmp_path / "a.h5")
    assert [path.name for path in tmp_path.iterdir()] == ["a.h5"]
