import dataclasses
import os
import time
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from evslip.codecs import write_events
from evslip.config.sections.robot import RobotSpec
from evslip.data import record_file
from evslip.data.footage import Footage
from evslip.data.intervals import Interval
from evslip.data.record import Record, provenance
from evslip.draws.draw import draw
from evslip.events.stream import Events, empty_events
from evslip.utils.errors import DataError
from evslip.windows import cutting
from evslip.windows.settings import WindowSettings
from sample_records import CONFIG, assert_equal, random_events, simulated

PARAMS = draw(CONFIG, 3, "test")


@st.composite
def records(draw_from: st.DrawFn) -> Record:
    kind = draw_from(st.sampled_from(["simulated", "rejected", "recording"]))
    rng = np.random.default_rng(draw_from(st.integers(0, 2**32)))
    events = random_events(rng, draw_from(st.sampled_from([0, 1, 2, 300])), labelled=draw_from(st.booleans()))
    if kind == "simulated":
        sample = simulated(draw_from(st.integers(0, 20)), steps=draw_from(st.integers(1, 12)))
        return dataclasses.replace(sample, events=events)
    if kind == "rejected":
        reason = (
            draw_from(st.sampled_from(["never_held", "tipped"])),
            draw_from(st.text(st.characters(codec="utf-8"))),
        )
        reason = (reason[0], reason[1].replace("\x00", ""))
        return Record(
            kind="rejected",
            name="test/0000003",
            size=(40, 30),
            events=empty_events(),
            split="test",
            index=3,
            params=PARAMS,
            rejection=reason,
        )
    start = draw_from(st.integers(-(2**50), 2**50))
    return Record(
        kind="recording",
        name=draw_from(st.sampled_from(["desk", "größe 1"])),
        size=(40, 30),
        events=events.replace(t_us=events.t_us * draw_from(st.sampled_from([1, 10**6])) + start),
        stats=draw_from(st.dictionaries(st.sampled_from("abc"), st.integers(-5, 2**40))),
    )


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(records())
def test_what_is_read_is_what_was_written(tmp_path: Path, sample: Record):
    record_file.write(tmp_path / "a.h5", sample)
    assert_equal(record_file.read(tmp_path / "a.h5"), sample)


def test_equal_records_have_equal_bytes_whenever_they_are_written():
    first = record_file.encode(simulated())
    time.sleep(1.1)  # HDF5 counts time in seconds
    assert record_file.encode(simulated()) == first
    assert record_file.encode(simulated(1)) != first


def test_read_and_encoded_again_the_bytes_are_the_same(tmp_path: Path):
    record_file.write(tmp_path / "a.h5", simulated())
    assert record_file.encode(record_file.read(tmp_path / "a.h5")) == (tmp_path / "a.h5").read_bytes()


def test_events_can_be_left_on_disk(tmp_path: Path):
    record_file.write(tmp_path / "a.h5", simulated())
    assert record_file.read(tmp_path / "a.h5", events=False).events.count == 0


def test_the_layout_is_that_of_dsec(tmp_path: Path):
    sample = simulated(events=5000)
    record_file.write(tmp_path / "a.h5", sample)
    with h5py.File(tmp_path / "a.h5") as file:
        t = file["events/t"][()].astype(np.int64)
        np.testing.assert_array_equal(t + file["t_offset"][()], sample.events.t_us)
        assert file["events/t"].dtype == np.uint32
        index = file["ms_to_idx"][()]
        # The definition in DSEC: t[ms_to_idx[ms]] >= ms * 1000 and t[ms_to_idx[ms] - 1] < ms * 1000.
        for ms, i in enumerate(index):
            assert (t[i:] >= ms * 1000).all()
            assert (t[:i] < ms * 1000).all()
        assert len(index) == t[-1] // 1000 + 2
        for name in ("x", "y", "t", "p", "body", "cause"):
            stored = file["events"][name]
            assert (stored.compression, stored.shuffle, stored.fletcher32) == ("gzip", True, True)


def test_an_event_costs_at_most_three_and_a_half_bytes(tmp_path: Path):
    # Coordinates and times as in a scene with edges; labels that follow the coordinates, as those of bodies do.
    rng = np.random.default_rng(0)
    n = 300_000
    x = rng.normal(20, 5, n).clip(0, 39).astype(np.uint16)
    y = rng.normal(15, 4, n).clip(0, 29).astype(np.uint16)
    events = Events(
        np.sort(rng.integers(0, 4_000_000, n)),
        x,
        y,
        rng.random(n) < 0.5,
        (x // 20).astype(np.uint8),
        np.zeros(n, np.uint8),
    )
    sample = dataclasses.replace(simulated(), events=events)
    assert len(record_file.encode(sample)) / n <= 3.5


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda s: {"kind": "dreamt"}, "kind 'dreamt' is unknown"),
        (lambda s: {"size": (0, 30)}, "size is 0 x 30"),
        (lambda s: {"size": (20, 30)}, "out of range"),
        (lambda s: {"size": (41, 30)}, "not that of its camera"),
        (lambda s: {"params": None}, "needs its parameters"),
        (lambda s: {"truth": None}, "needs its parameters"),
        (lambda s: {"index": 9}, "its parameters are those of"),
        (lambda s: {"rejection": ("tipped", "")}, "rejection is"),
        (lambda s: {"events": s.events.replace(t_us=s.events.t_us[::-1])}, "never decrease"),
        (lambda s: {"events": s.events.replace(x=s.events.x[:-1])}, "events/x"),
        (lambda s: {"events": s.events.replace(p=s.events.p.astype(np.uint8))}, "events/p"),
        (lambda s: {"events": s.events.replace(body=s.events.x.astype(np.uint8))}, "events/body"),
        (lambda s: {"events": s.events.replace(cause=np.full(200, 5, np.uint8))}, "events/cause"),
        (lambda s: {"trajectory": s.trajectory._replace(joints=s.trajectory.joints[:, :8])}, "joints"),
        (lambda s: {"trajectory": s.trajectory._replace(params=PARAMS)}, "other parameters"),
        (lambda s: {"trajectory": s.trajectory._replace(floor_force_n=np.full(5, np.nan))}, "not finite"),
        (lambda s: {"truth": s.truth._replace(t_us=s.truth.t_us + 1)}, "not the trajectory's"),
        (lambda s: {"truth": s.truth._replace(held=s.truth.theta_deg)}, "held"),
        (
            lambda s: {"truth": s.truth._replace(rotation=0 * s.truth.rotation)},
            "rotation.*quaternion of length 0",
        ),
        (lambda s: {"truth": s.truth._replace(position_m=s.truth.position_m + 1e30)}, "truth/position_m.*beyond 1e"),
        (lambda s: {"truth": s.truth._replace(span_us=(5, 4))}, "span_us 5 to 4"),
        (lambda s: {"truth": s.truth._replace(onset_us=2**62)}, "onset_us"),
        (lambda s: {"intervals": (Interval(0, 2**62, "slip"),)}, "labels: slip from 0 to 4.* no interval"),
        (lambda s: {"intervals": (Interval(0, 2**40, "slip"),)}, "labels: 305 h in all"),
        (lambda s: {"intervals": (Interval(5, 5, "slip"),)}, "labels"),
        (lambda s: {"intervals": (Interval(5, 9, "slip"), Interval(0, 2, "hold"))}, "labels.*overlaps"),
    ],
)
def test_parts_that_contradict_one_another_are_refused(change, message: str):
    sample = simulated()
    with pytest.raises(DataError, match=message) as caught:
        record_file.encode(dataclasses.replace(sample, **change(sample)))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda f: f.attrs.__setitem__("format", "other"), "not a record of evslip"),
        (lambda f: f.attrs.__setitem__("version", 2), "version 2 of the format"),
        (lambda f: f.attrs.__setitem__("width", "wide"), "attribute width"),
        (lambda f: f.attrs.__setitem__("stats", "[1]"), "JSON object"),
        (lambda f: f.attrs.__setitem__("stats", "{"), "damaged"),
        (lambda f: f.attrs.__setitem__("params", "{}"), "stored parameters"),
        (lambda f: f.attrs.__delitem__("params"), "no parameters"),
        (lambda f: f.__delitem__("events"), "no group events"),
        (lambda f: f.__delitem__("events/y"), "y is missing"),
        (lambda f: f.__delitem__("truth"), "needs its parameters"),
        (lambda f: f["truth"].attrs.__delitem__("span_us"), "span_us.*expected 2 whole numbers"),
        (lambda f: f["truth"].attrs.__setitem__("span_us", [0.5, 1]), "span_us.*expected 2 whole numbers"),
        (lambda f: (f.__delitem__("truth"), f.__setitem__("truth", [1])), "truth is no group"),
        (lambda f: f.attrs.__setitem__("kind", "dreamt"), "kind 'dreamt' is unknown"),
        (lambda f: f["ms_to_idx"].__setitem__(3, 7_000), "ms_to_idx: 7000 at 3 ms"),
        (lambda f: f["ms_to_idx"].__setitem__(slice(None), 0), "ms_to_idx: 0 at 1 ms"),
        (lambda f: f["truth/phase"].__setitem__(0, 99), "truth/phase: 99"),
        *[
            (
                lambda f, column=column, value=value: f["truth/episodes"].__setitem__((0, column), value),
                "truth/episodes",
            )
            for column in range(6)
            for value in ((99, -1, 0.5, np.nan) if column in (2, 3) else (np.inf, np.nan))
        ],
    ],
)
def test_files_that_were_tampered_with_are_refused(tmp_path: Path, edit, message: str):
    path = tmp_path / "a.h5"
    record_file.write(path, simulated())
    with h5py.File(path, "r+") as file:
        edit(file)
    with pytest.raises(DataError, match=message) as caught:
        record_file.read(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_names_of_any_bytes_are_texts(tmp_path: Path):
    path = tmp_path / os.fsdecode(b"r\xffc.npz")
    write_events(path, labelled().events, (40, 30))
    for record in (record_file.read_recording(path), record_file.open_recording(path)[0]):
        record_file.write(tmp_path / "a.h5", record)
        assert record_file.read(tmp_path / "a.h5").name == "r\\xffc"
    with h5py.File(tmp_path / "a.h5", "r+") as file:
        file.attrs.create("name", b"r\xffc", dtype=h5py.string_dtype())
    assert record_file.read(tmp_path / "a.h5").name == "r\\xffc"


def labelled(*intervals: Interval, **parts: Any) -> Record:
    events = random_events(np.random.default_rng(0), 300, labelled=False)
    return Record(kind="recording", name="a", size=(40, 30), events=events, intervals=intervals, **parts)


def test_labels_lie_where_something_was_recorded(tmp_path: Path):
    path = tmp_path / "a.h5"
    late = Interval(60_000, 70_000, "slip")  # the last event is before 50 ms
    record_file.write(path, labelled(late))
    for verb in (record_file.read, record_file.read_recording):
        with pytest.raises(DataError, match=r"labels: slip from 0\.06 to 0\.07 s, but the recording ends at 0\.04"):
            verb(path)
    record_file.write(path, labelled(Interval(0, 20_000_000, "hold")))
    with pytest.raises(DataError, match=r"labels: hold from 0 to 20 s, but"):
        record_file.read(path)
    frames = Footage(np.array([0, 80_000]), np.zeros((2, 30, 40), np.uint8))
    record_file.write(path, labelled(late, footage=frames))
    assert record_file.read(path).intervals == (late,)


def test_records_from_before_episodes_and_pad_friction_are_read(tmp_path: Path):
    path = tmp_path / "a.h5"
    record_file.write(path, simulated())
    with h5py.File(path, "r+") as file:
        for name in ("truth/episodes", "truth/phase", "trajectory/pad_friction", "trajectory/pad_utilisation"):
            del file[name]
    old, new = record_file.read(path), simulated()
    assert old.truth is not None and old.trajectory is not None and new.truth is not None
    assert old.truth.episodes == () and old.truth.phase is None and old.trajectory.pad_friction is None
    assert_equal(old.truth.rotation, new.truth.rotation)


def test_a_claim_of_endless_data_is_refused_before_memory_is_taken(tmp_path: Path):
    path = tmp_path / "a.h5"
    record_file.write(path, simulated())
    with h5py.File(path, "r+") as file:
        for name in ("x", "y", "t", "p", "body", "cause"):
            del file["events"][name]
            file["events"].create_dataset(name, shape=(2**40,), dtype=np.uint8, chunks=(2**16,))
    with pytest.raises(DataError, match="claims"):
        record_file.read(path)


def test_every_truncation_is_refused(tmp_path: Path):
    data = record_file.encode(simulated(events=20))
    path = tmp_path / "a.h5"
    for length in [*range(200), *range(200, len(data), 97), *range(len(data) - 50, len(data))]:
        path.write_bytes(data[:length])
        with pytest.raises(DataError):
            record_file.read(path)


def test_mutated_files_are_refused_or_their_arrays_are_unharmed(tmp_path: Path):
    sample = simulated(events=50)
    data = record_file.encode(sample)
    rng = np.random.default_rng(0)
    path = tmp_path / "a.h5"
    for _ in range(300):
        mutated = np.frombuffer(data, np.uint8).copy()
        where = rng.integers(0, len(data), rng.integers(1, 5))
        mutated[where] ^= rng.integers(1, 256, len(where)).astype(np.uint8)
        path.write_bytes(mutated.tobytes())
        try:
            read = record_file.read(path)
        except DataError as error:
            assert "\n" not in str(error)
        else:
            assert_equal(read.events, sample.events)
            if read.params == sample.params:
                assert_equal(read.trajectory, sample.trajectory)


@pytest.mark.parametrize("content", [b"", b"x", b"not HDF5 at all" * 100])
def test_what_is_not_hdf5_is_refused(tmp_path: Path, content: bytes):
    (tmp_path / "a.h5").write_bytes(content)
    with pytest.raises(DataError, match=r"empty|not an HDF5 file"):
        record_file.read(tmp_path / "a.h5")


def test_what_is_no_file_is_refused(tmp_path: Path):
    with pytest.raises(DataError, match="no such file"):
        record_file.read(tmp_path / "a.h5")
    with pytest.raises(DataError, match="is a folder"):
        record_file.read(tmp_path)


def test_a_contradiction_leaves_no_file(tmp_path: Path):
    with pytest.raises(DataError):
        record_file.write(tmp_path / "a.h5", dataclasses.replace(simulated(), size=(1, 1)))
    assert not any(tmp_path.iterdir())


def test_provenance_names_versions():
    versions = provenance("h5py")
    assert set(versions) == {"evslip", "numpy", "hdf5", "h5py"}
    assert versions["h5py"] == h5py.__version__


def test_the_offset_of_the_times_is_guarded_too(tmp_path: Path):
    sample = simulated()
    sample = dataclasses.replace(sample, events=sample.events.replace(t_us=sample.events.t_us - 2**40))
    whole = record_file.encode(sample)
    place = whole.index((-(2**40) + int(simulated().events.t_us[0])).to_bytes(8, "little", signed=True))
    for byte in range(8):
        damaged = bytearray(whole)
        damaged[place + byte] ^= 1
        (tmp_path / "a.h5").write_bytes(bytes(damaged))
        with pytest.raises(DataError):
            record_file.read(tmp_path / "a.h5")


def test_a_record_of_a_robot_whose_file_is_gone_is_read_and_cut_into_windows(tmp_path):
    sample = simulated(steps=400)
    assert sample.params is not None and sample.trajectory is not None
    robot = RobotSpec(kind=str(tmp_path / "gone.toml"), sha256="a" * 64)
    params = sample.params.model_copy(update={"robot": robot})
    sample = dataclasses.replace(sample, params=params, trajectory=sample.trajectory._replace(params=params))
    path = tmp_path / "record.h5"
    path.write_bytes(record_file.encode(sample))
    found = record_file.read(path)
    assert found.params is not None and found.params.robot == robot
    assert_equal(found.events, sample.events)
    cut, as_before = (
        list(map(str, cutting.labelled(record, WindowSettings()))) for record in (found, simulated(steps=400))
    )
    assert cut == as_before
