"""Whole samples in bags: read again by the libraries rosbags and mcap, and by evslip itself."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from evslip.cli import run
from evslip.codecs import open_events, read_events, write_events
from evslip.codecs.ros.bag_writer import BagWriter
from evslip.codecs.ros.composer import Composer
from evslip.codecs.ros.definitions import types
from evslip.codecs.ros.messages import PACKET
from evslip.codecs.ros.packing import PACKET_US
from evslip.config.sections.camera import CAMERAS
from evslip.data import record_file
from evslip.data.intervals import Interval
from evslip.data.record import Poses, Record
from evslip.events import Events
from evslip.events.stream import concatenate
from evslip.exchange.format_to_format import convert_format
from evslip.exchange.importing.recordings import import_recording
from evslip.exchange.importing.settings import Importing
from evslip.exchange.sample_bag import View, write_sample
from evslip.physics.robots.description import TCP_M
from evslip.rendering.camera import hand_camera
from evslip.rendering.poses import ScenePoses
from evslip.utils.errors import ConfigError, DataError
from sample_records import random_events, simulated
from shared_data import shared
from two_cameras import seen_by_two

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
    write_sample(path, [View(record, record.events.chunks(50))], frames_hz=0)
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


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_sample_of_two_cameras_lies_in_one_bag(suffix: str, tmp_path: Path):
    record = seen_by_two()
    record_file.write(tmp_path / "a.h5", record)
    path = tmp_path / f"b{suffix}"
    run(["convert", str(tmp_path / "a.h5"), str(path), "--frames-hz", "0"])
    for name in CAMERAS:
        assert open_whole(tmp_path / "a.h5", name).replace(body=None, cause=None) == open_whole(path, name)
    found = messages(path)
    topics = {topic for topic, _, _ in found}
    assert {f"/{name}/event_camera/{kind}" for name in CAMERAS for kind in ("events", "camera_info")} <= topics
    assert {m.header.frame_id for topic, _, m in found if topic == "/left/event_camera/events"} == {"left_camera"}
    trees = [m.transforms for topic, _, m in found if topic == "/tf"]
    assert {f.child_frame_id for f in trees[0]} == {"gripper", "object", "left_camera", "right_camera"}
    assert sum(topic == "/slip/label" for topic, _, _ in found) == 1
    with pytest.raises(
        DataError, match=r"cameras left, right; .* such as --camera left; evslip convert FILE OUT --camera left"
    ):
        open_events(path)
    with pytest.raises(DataError, match=r"such as --camera left, not 'top'"):
        open_events(path, "top")
    one = tmp_path / f"c{suffix}"
    run(["convert", str(tmp_path / "a.h5"), str(one), "--frames-hz", "0", "--camera", "right"])
    assert read_events(one) == open_whole(path, "right")
    for name, size in (("left", (40, 30)), ("right", (48, 30))):
        back = import_recording(path, tmp_path / f"{name}.h5", Importing(camera=name))
        assert back.size == size and back.events == open_whole(path, name) and back.truth is not None
    # As a bag of a stranger's two cameras, of events alone, from which one is chosen.
    run(["convert", str(path), str(tmp_path / "d.dvs.mcap"), "--camera", "right"])
    assert read_events(tmp_path / "d.dvs.mcap") == read_events(one)


@pytest.mark.parametrize("camera", ["left", "a_longer_name"])
@pytest.mark.parametrize("suffix", SUFFIXES)
def test_arrays_of_a_camera_of_several_are_those_of_another_reader(suffix: str, camera: str, tmp_path: Path):
    record = replace(moving(), footage=None, poses=None)
    other = replace(record, events=some_events(7))
    path = tmp_path / f"a.dvs{suffix}"
    write_sample(path, [View(record, [record.events], camera), View(other, [other.events], "other")], frames_hz=0)
    found = messages(path)
    arrays = [m for topic, _, m in found if topic == f"/{camera}/dvs/events"]
    assert {m.header.frame_id for m in arrays} == {f"{camera}_camera"}
    assert [event.x for m in arrays for event in m.events] == record.events.x.tolist()
    assert open_whole(path, "other") == other.events


def open_whole(path: Path, camera: str) -> Events:
    return concatenate(list(open_events(path, camera).parts))


def rotation_of(turn: Any) -> Rotation:
    return Rotation.from_quat([turn.x, turn.y, turn.z, turn.w])


@pytest.mark.parametrize("trembles", [False, True])
@pytest.mark.parametrize("suffix", [".bag", ".mcap"])
def test_the_frames_and_the_camera_show_the_object_where_the_renderer_does(suffix: str, trembles: bool, tmp_path: Path):
    record = simulated(0, events=3, steps=4)
    motion, params = record.trajectory, record.params
    assert motion is not None and params is not None
    lens = params.camera.model_copy(update={"k1": -0.2, "k2": 0.05, "p1": 0.01, "p2": -0.02})
    params = params.model_copy(update={"camera": lens})
    hand, thing = motion.gripper_pose.copy(), motion.object_pose.copy()
    hand[:, 3:] /= np.linalg.norm(hand[:, 3:], axis=1, keepdims=True)
    turns = Rotation.from_quat(hand[:, 3:], scalar_first=True)
    camera = hand_camera(params)
    thing[:, :3] = hand[:, :3] + turns.apply(camera.position + camera.rotation @ [0.02, -0.03, -0.4])
    moved = None
    if trembles:
        small = Rotation.from_rotvec(np.random.default_rng(0).normal(0, 0.01, (4, 3))).as_quat(scalar_first=True)
        moved = np.hstack([np.random.default_rng(1).normal(0, 0.003, (4, 3)), small])
    motion = motion._replace(params=params, gripper_pose=hand, object_pose=thing, camera_displacement=moved)
    write_sample(tmp_path / f"a{suffix}", [View(replace(record, params=params, trajectory=motion), [])], frames_hz=0)
    found = messages(tmp_path / f"a{suffix}")
    (info,) = (m for topic, _, m in found if topic == "/event_camera/camera_info")
    matrix, terms = (np.array(getattr(info, n if hasattr(info, n) else n.upper())) for n in ("k", "d"))
    assert (info.width, info.height) == SIZE and terms.tolist() == [-0.2, 0.05, 0.01, -0.02, 0.0]
    frames = [m.transforms for topic, _, m in found if topic == "/tf"]
    assert len(frames) == 4
    poses = ScenePoses(motion, camera, motion.t_us)
    for k, tree in enumerate(frames):
        assert [(f.header.frame_id, f.child_frame_id) for f in tree] == [
            ("world", "gripper"), ("world", "object"), ("gripper", "camera"),
        ]  # fmt: skip
        places = [
            np.array([f.transform.translation.x, f.transform.translation.y, f.transform.translation.z]) for f in tree
        ]
        hand_turn, _, eye_turn = (rotation_of(f.transform.rotation) for f in tree)
        seen = eye_turn.inv().apply(hand_turn.inv().apply(places[1] - places[0]) - places[2])
        assert seen[2] > 0.3  # it looks along its third axis
        x, y = camera.distortion.distort(*(seen[:2] / seen[2]))
        pixel = matrix.reshape(3, 3) @ [x, y, 1]
        own = poses.camera_rotation[k].T @ (poses.object_position[k] - poses.camera_position[k])
        np.testing.assert_allclose(pixel[:2] + 0.5, camera.project(own)[:2], atol=1e-3)


def test_a_simulated_sample_comes_back_with_its_truth(tmp_path: Path):
    """An object that turns about the point between the fingers, which the bag says, and does not slide."""
    record = simulated(0, events=300, steps=900)
    motion, truth = record.trajectory, record.truth
    assert motion is not None and truth is not None
    angle = np.radians(np.clip((np.arange(900) - 200) / 10, 0, 12))
    hand = np.tile([0.1, 0, 0.3, 1, 0, 0, 0], (900, 1))
    thing = hand.copy()
    thing[:, 3], thing[:, 5] = np.cos(angle / 2), np.sin(angle / 2)
    turn = Rotation.from_rotvec(np.outer(angle, [0, 1, 0]))
    thing[:, :3] += np.array(TCP_M) - turn.apply(TCP_M)
    held = np.ones(900, bool)
    record = replace(
        record,
        trajectory=motion._replace(gripper_pose=hand, object_pose=thing),
        truth=truth._replace(held=held),
        params=record.params,
    )
    write_sample(tmp_path / "a.mcap", [View(record, [record.events])], frames_hz=0)
    import_recording(tmp_path / "a.mcap", tmp_path / "b.h5", Importing())
    back = record_file.read(tmp_path / "b.h5")
    assert back.truth is not None and back.label == "slip"
    (slip,) = back.truth.episodes
    assert (slip.kind, slip.phase) == ("rotation", "")
    assert slip.rotation_deg == pytest.approx(12, abs=0.05) and slip.translation_mm < 0.01
    assert slip.start_us == back.truth.onset_us == pytest.approx(201_000, abs=2000)
    np.testing.assert_allclose(back.truth.spin_deg, -np.degrees(angle), atol=1e-3)
    assert import_recording(tmp_path / "a.mcap", tmp_path / "c.h5", Importing(centre_m=(0.0, 0.0, 0.01))).truth
    other = record_file.read(tmp_path / "c.h5").truth
    assert other is not None and other.episodes[0].kind == "mixed"  # another point does slide


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


def test_frames_of_times_below_0_are_said_to_be_left_out(tmp_path: Path):
    record = moving()
    assert record.footage is not None
    record = replace(record, footage=record.footage._replace(t_us=record.footage.t_us - 1))
    record_file.write(tmp_path / "a.h5", record)
    assert "1 frames of times below 0" in convert_format(tmp_path / "a.h5", tmp_path / "b.mcap").lost


def test_labels_of_a_bag_count_from_its_first_event(tmp_path: Path):
    record = moving()
    record = replace(record, events=record.events.replace(t_us=record.events.t_us + 100_000))
    write_sample(tmp_path / "a.mcap", [View(record, [record.events])])
    (tmp_path / "labels.csv").write_text("0,0.01,hold\n0.01,0.04,slip\n")
    back = import_recording(tmp_path / "a.mcap", tmp_path / "b.h5", Importing(labels=tmp_path / "labels.csv"))
    first_us = int(record.events.t_us[0])
    assert back.events == record.events and back.poses is not None and back.poses.t_us[0] == 0
    assert [i.start_us for i in back.intervals] == [first_us, first_us + 10_000]


@pytest.mark.parametrize(
    ("part", "place", "value", "message"),
    [
        ("object", (7, 1), np.nan, "/object/pose: pose 7 holds a number that is not finite"),
        ("gripper", (3, 0), np.inf, "/gripper/pose: pose 3 holds a number that is not finite"),
        ("gripper", (3, 0), 1e30, "is not below 1,000,000"),
        ("object", (9, slice(3, 7)), 0.0, "/object/pose: pose 9 has a quaternion of length 0, expected 1"),
    ],
)
def test_poses_of_a_bag_that_cannot_be_are_refused(part: str, place: tuple, value: float, message: str, tmp_path: Path):
    record = moving()
    assert record.poses is not None
    getattr(record.poses, f"{part}_pose")[place] = value
    write_sample(tmp_path / "a.mcap", [View(record, [record.events])])
    with pytest.raises(DataError, match=f"a.mcap: .*{message}"):
        import_recording(tmp_path / "a.mcap", tmp_path / "b.h5", Importing())


@pytest.mark.parametrize(("t_us", "message"), [([0, 10**12], "a span of 1,000,000 s"), ([5], "1 poses .* two or more")])
def test_poses_of_a_bag_at_times_that_cannot_be_are_refused(t_us: list[int], message: str, tmp_path: Path):
    record = moving()
    assert record.poses is not None
    poses = Poses(np.array(t_us), *(pose[: len(t_us)] for pose in record.poses[1:]))
    record = replace(record, poses=poses, footage=None)
    write_sample(tmp_path / "a.bag", [View(record, [record.events])])
    with pytest.raises(DataError, match=f"a.bag: {message}"):
        import_recording(tmp_path / "a.bag", tmp_path / "b.h5", Importing())


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("base", [2**63 - 1, 2**64 - 1])
def test_a_packet_of_no_time_is_refused(base: int, suffix: str, tmp_path: Path):
    path = tmp_path / f"a{suffix}"
    bag = BagWriter(path)
    packet = Composer(bag.cdr).packet(0, SIZE, 0, base, "mono", bytes(16))
    with path.open("wb", buffering=0) as file:
        bag.put("/event_camera/events", PACKET, 0, packet)
        bag.finish(file)
    with pytest.raises(DataError, match=f"a time base of {base} ns"):
        read_events(path)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_pictures_of_an_unknown_encoding_are_named(suffix: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    image = Composer.image
    monkeypatch.setattr(Composer, "image", lambda *given: image(*given).replace(b"rgb8", b"yuv9"))
    record = moving()
    path = tmp_path / f"a{suffix}"
    write_sample(path, [View(record, [record.events])])
    with pytest.raises(DataError, match="unknown image: pixels in the encoding 'yuv9'; known are mono8, "):
        import_recording(path, tmp_path / "b.h5", Importing())
    assert import_recording(path, tmp_path / "b.h5", Importing(frames=False)).events == record.events


def test_a_bag_is_said_to_hold_no_labelled_intervals(tmp_path: Path):
    record = replace(moving(), intervals=(Interval(0, 20_000, "slip"),))
    record_file.write(tmp_path / "a.h5", record)
    assert convert_format(tmp_path / "a.h5", tmp_path / "a.mcap").lost == ("the intervals that a person labelled",)


def test_mcap_files_open_with_the_package_mcap(tmp_path: Path):
    reader = pytest.importorskip("mcap.reader")
    decoder = pytest.importorskip("mcap_ros2.decoder")
    record = moving()
    write_sample(tmp_path / "a.mcap", [View(record, [record.events])])
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
        write_sample(tmp_path / "a.bag", [View(moving(), [])], frames_hz=-1)
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
