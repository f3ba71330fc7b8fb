"""Whole samples in bags: read again by the libraries rosbags and mcap, and by evslip itself."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from evslip.cli import run
from evslip.codecs import open_events, read_events, write_events
from evslip.codecs.ros.definitions import types
from evslip.codecs.ros.packing import PACKET_US
from evslip.data import record_file
from evslip.data.record import Poses, Record
from evslip.events import Events
from evslip.exchange.importing.recordings import import_recording
from evslip.exchange.importing.settings import Importing
from evslip.exchange.sample_bag import write_sample
from evslip.utils.errors import ConfigError, DataError
from sample_records import random_events, simulated
from shared_data import shared

pytest.importorskip("rosbags")
SIZE = (40, 30)
SUFFIXES = (".bag", ".db3", ".mcap")


def messages(path: Path) -> list[tuple[str, int, Any]]:
    """Topic, time and content of each message, as the library reads them by the definitions in the bag."""
    from rosbags.highlevel import AnyReader

    with AnyReader([path]) as reader:
        return [
            (connection.topic, stamp // 1000, reader.deserialize(data, connection.msgtype))
            for connection, stamp, data in reader.messages()
        ]


def some_events(count: int = 3000, start_us: int = 0) -> Events:
    events = random_events(np.random.default_rng(0), count, SIZE, labelled=False)
    return events.replace(t_us=events.t_us * 3 + start_us)


def written(path: Path, events: Events) -> Path:
    write_events(path, events, SIZE)
    return path


@pytest.mark.parametrize("name", [f"a{kind}{suffix}" for suffix in SUFFIXES for kind in ("", ".evt3", ".dvs")])
@pytest.mark.parametrize("count", [0, 1, 2, 3000])
def test_events_are_read_again_exactly(name: str, count: int, tmp_path: Path):
    events = some_events(count, start_us=10**9 if "evt3" not in name else 1000)
    path = written(tmp_path / name, events)
    assert read_events(path) == events
    assert open_events(path).size == SIZE
    assert [file.name for file in tmp_path.iterdir()] == [name]  # nothing else is left behind


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_arrays_and_packets_are_those_of_another_reader(suffix: str, tmp_path: Path):
    events = some_events(start_us=1_700_000_000_000_000)
    found = messages(written(tmp_path / f"a.dvs{suffix}", events))
    rows = [event for _, _, array in found for event in array.events]
    t_us = [event.ts.sec * 10**6 + event.ts.nanosec // 1000 for event in rows]
    read = np.array([t_us, *([getattr(event, name) for event in rows] for name in ("x", "y", "polarity"))])
    np.testing.assert_array_equal(read, np.array(events.columns))
    assert {(array.width, array.height) for _, _, array in found} == {SIZE}
    packets = messages(written(tmp_path / f"b{suffix}", events))
    assert [packet.seq for _, _, packet in packets] == list(range(len(packets)))
    assert {packet.encoding for _, _, packet in packets} == {"mono"}
    words = [np.frombuffer(packet.events.tobytes(), "<u8") for _, _, packet in packets]
    bases = [packet.time_base for _, _, packet in packets]
    times = np.concatenate([base + (w & 0xFFFFFFFF).astype(np.int64) for base, w in zip(bases, words, strict=True)])
    np.testing.assert_array_equal(times, events.t_us * 1000)
    assert all((w & 0xFFFFFFFF).max() < PACKET_US * 1000 for w in words)


def test_messages_do_not_depend_on_how_the_events_come(tmp_path: Path):
    events = some_events()
    whole = messages(written(tmp_path / "a.mcap", events))
    from evslip.codecs.writers import writing

    with writing(tmp_path / "b.mcap", SIZE) as push:
        for part in events.chunks(7):
            push(part)
    parts = messages(tmp_path / "b.mcap")
    assert len(whole) == len(parts) > 5
    for (_, t_us, one), (_, other_us, two) in zip(whole, parts, strict=True):
        assert (t_us, one.seq, one.time_base) == (other_us, two.seq, two.time_base)
        np.testing.assert_array_equal(one.events, two.events)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_real_recording_keeps_its_golden_counts(suffix: str, tmp_path: Path):
    source = shared("real", "event_packets.bag")
    for kind in ("", ".evt3", ".dvs"):
        out = tmp_path / f"a{kind}{suffix}"
        run(["convert", str(source), str(out)])
        events = read_events(out)
        assert (int((~events.p).sum()), int(events.p.sum())) == (218_291, 125_183)
        assert events == read_events(source)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_whole_sample_lies_in_one_bag(suffix: str, tmp_path: Path):
    record = simulated(0, events=300, steps=5)
    assert record.trajectory is not None and record.truth is not None and record.params is not None
    path = tmp_path / f"a{suffix}"
    write_sample(path, record, record.events.chunks(50), frames_hz=0)
    found = messages(path)
    by_topic = {topic: [m for t, _, m in found if t == topic] for topic, _, _ in found}
    assert [t for _, t, _ in found] == sorted(t for _, t, _ in found)
    assert by_topic["/sample/parameters"][0].data == record.params.model_dump_json()
    assert by_topic["/slip/label"][0].data == record.label
    for topic, poses in (
        ("/gripper/pose", record.trajectory.gripper_pose),
        ("/object/pose", record.trajectory.object_pose),
    ):
        read = [
            [p.x, p.y, p.z, q.w, q.x, q.y, q.z]
            for p, q in ((m.pose.position, m.pose.orientation) for m in by_topic[topic])
        ]
        np.testing.assert_array_equal(np.array(read, np.float32), poses.astype(np.float32))
    assert [m.data for m in by_topic["/object/held"]] == record.truth.held.tolist()
    np.testing.assert_allclose([m.data for m in by_topic["/slip/rotation_deg"]], record.truth.spin_deg, rtol=1e-6)
    force = record.trajectory.pad_force_n.mean(1)
    np.testing.assert_allclose([m.data for m in by_topic["/gripper/grip_force_n"]], force, rtol=1e-6)
    plain = record.events.replace(body=None, cause=None)
    assert read_events(path) == plain


def moving(seconds: float = 0.4, frames: int = 5) -> Record:
    """A recording with poses and frames whose object turns in the grip."""
    from evslip.data.footage import Footage

    t_us = np.arange(0, round(seconds * 1e6), 1000, dtype=np.int64)
    turn = np.radians(np.clip((t_us - 150_000) / 1e4, 0, 8))
    gripper = np.tile(np.array([0.1, 0, 0.3, 1, 0, 0, 0], np.float32), (len(t_us), 1))
    thing = gripper.copy()
    thing[:, 3], thing[:, 5] = np.cos(turn / 2), np.sin(turn / 2)
    times = np.linspace(0, seconds * 9e5, frames).astype(np.int64)
    images = np.random.default_rng(0).integers(0, 256, (frames, SIZE[1], SIZE[0], 3), np.uint8)
    events = random_events(np.random.default_rng(1), 500, SIZE, labelled=False)
    return Record(
        kind="recording", name="a", size=SIZE, events=events, poses=Poses(t_us, gripper, thing),
        footage=Footage(times, images),
    )  # fmt: skip


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_poses_and_frames_come_back_by_an_import(suffix: str, tmp_path: Path):
    record = moving()
    record_file.write(tmp_path / "a.h5", record)
    run(["convert", str(tmp_path / "a.h5"), str(tmp_path / f"b{suffix}")])
    back = import_recording(tmp_path / f"b{suffix}", tmp_path / "c.h5", Importing())
    assert back.poses is not None and record.poses is not None
    assert back.footage is not None and record.footage is not None
    np.testing.assert_array_equal(back.footage.images, record.footage.images)
    np.testing.assert_array_equal(back.footage.t_us, record.footage.t_us)
    np.testing.assert_allclose(back.poses.object_pose, record.poses.object_pose, atol=1e-6)
    assert back.events == record.events and back.truth is None  # nobody said when the object was held
    part = tmp_path / f"part{suffix}"
    run(["convert", str(tmp_path / "a.h5"), str(part), "--polarity", "on"])
    assert len({topic for topic, _, _ in messages(part)}) == 1


def test_mcap_files_open_with_the_package_mcap(tmp_path: Path):
    reader = pytest.importorskip("mcap.reader")
    decoder = pytest.importorskip("mcap_ros2.decoder")
    record = moving()
    write_sample(tmp_path / "a.mcap", record, [record.events])
    with (tmp_path / "a.mcap").open("rb") as file:
        made = reader.make_reader(file, decoder_factories=[decoder.DecoderFactory()])
        found = [(channel.topic, content) for _, channel, _, content in made.iter_decoded_messages()]
    assert record.poses is not None and record.footage is not None
    poses = [content.pose for topic, content in found if topic == "/object/pose"]
    assert len(poses) == len(record.poses.t_us)
    images = [bytes(content.data) for topic, content in found if topic == "/event_camera/image_raw"]
    assert images == [image.tobytes() for image in record.footage.images]
    count = sum(len(content.events) // 8 for topic, content in found if topic == "/event_camera/events")
    assert count == record.events.count


def test_what_bags_cannot_hold_is_said(tmp_path: Path):
    late = some_events(start_us=2**52)
    with pytest.raises(DataError, match="--from-zero"):
        write_events(tmp_path / "a.bag", late, SIZE)
    with pytest.raises(DataError, match="2048 at most"):
        write_events(tmp_path / "a.evt3.mcap", some_events(), (4000, 30))
    with pytest.raises(ConfigError, match="frames-hz"):
        write_sample(tmp_path / "a.bag", moving(), [], frames_hz=-1)
    assert list(tmp_path.iterdir()) == []
    assert types(True) is types(True)


def test_a_cut_bag_is_refused(tmp_path: Path):
    events, rng = some_events(60), np.random.default_rng(0)
    for suffix in SUFFIXES:
        whole = written(tmp_path / f"a{suffix}", events).read_bytes()
        pages = range(0, len(whole), 4096)
        for length in {0, 1, 99, 100, *pages, *rng.integers(0, len(whole), 15).tolist()}:
            (tmp_path / f"cut{suffix}").write_bytes(whole[:length])
            with pytest.raises(DataError, match=r"cut\."):
                read_events(tmp_path / f"cut{suffix}")
