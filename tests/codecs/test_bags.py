"""Bags of ROS 1 and ROS 2: arrays of events, packets of words, images."""

from pathlib import Path

import lz4.frame
import numpy as np
import pytest
import zstandard

from evslip.cli import run
from evslip.codecs import format_of, open_events, read_events
from evslip.codecs.prophesee import evt3
from evslip.codecs.ros import bag, bag2, cameras
from evslip.data.record_file import read_recording
from evslip.events.stream import Events, concatenate
from evslip.exchange.importing.recordings import import_recording
from evslip.utils.errors import DataError
from evslip.view.explorer.shelf import open_shelf
from ros_bags import SUFFIXES, Library, arrays, packets
from sample_records import assert_equal, random_events
from shared_data import shared

pytest.importorskip("rosbags")
SIZE = (40, 30)


def some_events(count: int = 400, start_us: int = 0) -> Events:
    events = random_events(np.random.default_rng(0), count, SIZE, labelled=False)
    return events.replace(t_us=events.t_us + start_us)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_arrays_of_events_and_images_are_read(suffix: str, tmp_path: Path):
    rng = np.random.default_rng(1)
    images = [rng.integers(0, 256, (30, 40), np.uint8), rng.integers(0, 256, (30, 40, 3), np.uint8)]
    path = arrays(tmp_path / f"a{suffix}", some_events(), SIZE, images)
    recording = read_recording(path)
    assert_equal(recording.events, some_events())
    assert recording.size == SIZE
    times, frames = zip(*format_of(path).codec.frames(path), strict=True)
    assert times == (2_000_000, 2_000_005)
    np.testing.assert_array_equal(frames[0], images[0])
    np.testing.assert_array_equal(frames[1], images[1][..., ::-1])


@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_short_arrays_in_cdr_are_read(count: int, tmp_path: Path):
    path = arrays(tmp_path / "a.db3", some_events(count), SIZE, [], pieces=1)
    assert_equal(read_events(path), some_events(count))


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("encoding", ["evt3", "mono", "libcaer"])
def test_packets_are_read(suffix: str, encoding: str, tmp_path: Path):
    # From 16 s on the words of evt3 wrap within the recording.
    events = some_events(3000, start_us=2**24 - 20_000 if encoding == "evt3" else 10**15)
    recording = read_recording(packets(tmp_path / f"a{suffix}", events, SIZE, encoding, pieces=7))
    assert_equal(recording.events, events)
    assert recording.size == SIZE


def without_one(path: Path, parts: list[Events], lost: int) -> Path:
    """A bag of packets in evt3 of which one is lost."""
    encoder, library = evt3.Encoder(), Library(path)
    contents = [(n, encoder.encode(part).astype("<u2").tobytes()) for n, part in enumerate(parts)]
    return library.write(library.packet(content, SIZE, n, "evt3") for n, content in contents if n != lost)


def test_a_lost_packet_takes_the_words_without_a_time_and_a_row_along(tmp_path: Path):
    events = some_events(3000)
    events = events.replace(y=np.repeat(np.arange(60, dtype=np.uint16) % 30, 50))  # said once in 50 events
    parts = [events.select(part) for part in np.array_split(np.arange(3000), [480, 980, 1490, 2010])]
    read = read_events(without_one(tmp_path / "a.mcap", parts, 2))
    behind = parts[3]
    says_time = np.flatnonzero(behind.t_us >> 12 > parts[2].t_us[-1] >> 12)[0]
    says_row = says_time + np.flatnonzero(np.diff(behind.y[says_time - 1 :]))[0]
    assert 0 < says_time < says_row
    assert_equal(read, concatenate([*parts[:2], behind.select(np.arange(says_row, len(behind))), parts[4]]))


@pytest.mark.parametrize("gap_s", [1, 10, 16])
def test_times_go_on_behind_lost_packets_of_less_than_their_range(gap_s: int, tmp_path: Path):
    parts = [some_events(300, start_us=round(1e6 * at)) for at in (12, 12.1, 12 + gap_s)]
    read = read_events(without_one(tmp_path / "a.mcap", parts, 1))
    assert_equal(read, concatenate([parts[0], parts[2]]))


def test_triggers_hold_no_events_and_other_encodings_are_named(tmp_path: Path):
    library = Library(tmp_path / "a.db3")
    path = library.write([library.packet(bytes(8), SIZE, 0, "trigger")])
    assert len(read_events(path)) == 0
    library = Library(tmp_path / "b.db3")
    path = library.write([library.packet(bytes(8), SIZE, 0, "libcaer_cmp")])
    with pytest.raises(DataError, match="encoding 'libcaer_cmp'; known are evt3, mono, libcaer, trigger"):
        read_events(path)


@pytest.mark.parametrize("suffix", [".db3", ".mcap"])
def test_the_folder_of_a_bag_is_read_like_its_file(suffix: str, tmp_path: Path, capsys):
    path = packets(tmp_path / f"a{suffix}", some_events(), SIZE, "evt3")
    folder = path.parent
    assert open_events(folder).size == SIZE
    assert_equal(read_events(folder), read_events(path))
    assert import_recording(folder, tmp_path / "rec.h5").size == SIZE
    assert len(open_shelf(folder)) == 1
    run(["info", str(folder)])
    assert "rosbag2" in capsys.readouterr().out
    run(["convert", str(folder), str(tmp_path / "a.es")])
    assert_equal(read_events(tmp_path / "a.es"), some_events())


def test_chunks_may_be_packed_files_and_messages_not(tmp_path: Path):
    path = packets(tmp_path / "a.mcap", some_events(), SIZE, "evt3", packed="storage")
    assert_equal(read_events(path), some_events())
    for packed in ("message", "file"):
        path = packets(tmp_path / f"{packed}.db3", some_events(), SIZE, "evt3", packed=packed)
        with pytest.raises(DataError, match="compressed by files or messages; expected one without"):
            read_events(path.parent)


@pytest.mark.parametrize("pack", [lz4.frame.compress, zstandard.compress])
def test_a_chunk_of_mcap_unpacks_to_what_it_claims(pack, monkeypatch):
    unpack = bag2._unpack_lz4 if pack is lz4.frame.compress else bag2._unpack_zstd
    assert unpack(pack(bytes(1000)), 1000) == bytes(1000)
    for claim in (999, 1001, 10):
        with pytest.raises(ValueError, match="ends early or expands beyond"):
            unpack(pack(bytes(1000)), claim)
    monkeypatch.setattr(bag2, "LARGEST_CHUNK", 500)
    with pytest.raises(ValueError, match="a chunk of 1000 bytes, expected at most 500"):
        unpack(pack(bytes(1000)), 1000)


def test_bags_without_events_say_what_they_hold(tmp_path: Path):
    for suffix in SUFFIXES:
        library = Library(tmp_path / f"{suffix[1:]}{suffix}")
        path = library.write([library.image(np.zeros((2, 2), np.uint8), 0)])
        with pytest.raises(DataError, match="holds no events; its messages are sensor_msgs/msg/Image"):
            read_events(path)


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("kind", ["evt3", "mono", "arrays"])
def test_damaged_bags_take_one_line(suffix: str, kind: str, tmp_path: Path):
    events, path = some_events(60), tmp_path / f"a{suffix}"
    path = arrays(path, events, SIZE, []) if kind == "arrays" else packets(path, events, SIZE, kind)
    whole, rng = path.read_bytes(), np.random.default_rng(2)
    places = [place for place in range(len(whole)) if whole[place]]
    for number in range(50):
        damaged = bytearray(whole)
        for place in rng.choice(places, 4):
            damaged[place] = rng.integers(0, 256)
        mutated = tmp_path / f"mutated{suffix}"
        mutated.write_bytes(damaged if number % 3 else damaged[: rng.integers(1, len(whole))])
        try:
            read_events(mutated)
        except DataError as error:
            assert "\n" not in str(error)
            assert str(error).startswith(str(mutated))


def test_a_damaged_description_of_a_folder_takes_one_line(tmp_path: Path):
    folder = packets(tmp_path / "a.db3", some_events(), SIZE, "evt3").parent
    text = (folder / "metadata.yaml").read_text()
    for damaged in ("", "x: [", text.replace("version: 9", "version: 99"), text.replace("a.db3", "b.db3"), text[:200]):
        (folder / "metadata.yaml").write_text(damaged)
        with pytest.raises(DataError, match="damaged bag") as caught:
            read_events(folder)
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["event_packets.bag", "event_packets_ros2_db3"])
def test_packets_of_a_real_camera_have_their_golden_counts(name: str):
    events = read_events(shared("real", name))
    assert (int((~events.p).sum()), int(events.p.sum())) == (218_291, 125_183)


def test_a_large_chunk_of_a_bag_is_refused_before_it_is_kept(monkeypatch, tmp_path: Path):
    path = packets(tmp_path / "a.mcap", some_events(3000), SIZE, "evt3", packed="storage")
    monkeypatch.setattr(bag2, "LARGEST_CHUNK", 100)
    with pytest.raises(DataError, match="damaged bag: a chunk of"):
        read_events(path)
    assert bag.LARGEST_CHUNK > 100


@pytest.mark.parametrize(
    ("topics", "names"),
    [
        (["/dvs/events"], ["dvs"]),
        (["/left/event_camera/events", "/right/event_camera/events"], ["left", "right"]),
        (["/davis/left/events", "/davis/right/events"], ["left", "right"]),
        (["/dvs/events", "/dvs2/filtered/events"], ["dvs", "dvs2"]),
        (["/a/left/events", "/a/right/events", "/b/left/events"], ["a/left", "a/right", "b/left"]),
        (["/dvs/events", "/dvs/events_filtered"], ["events", "events_filtered"]),
    ],
)
def test_cameras_are_named_by_what_tells_their_topics_apart(topics: list[str], names: list[str]):
    assert cameras.names(topics) == names


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_one_of_two_cameras_below_one_namespace_is_chosen(suffix: str, tmp_path: Path):
    library, events = Library(tmp_path / f"a{suffix}"), {"left": some_events(50), "right": some_events(80)}
    path = library.write(library.array(seen, SIZE, f"/davis/{name}/events") for name, seen in events.items())
    for name, seen in events.items():
        assert_equal(read_recording(path, name).events, seen)
    for name in (None, "davis"):
        with pytest.raises(DataError, match="holds the events of the cameras left, right; expected one of them"):
            read_events(path) if name is None else read_recording(path, name)


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize(
    ("images", "expected"),
    [
        ({"/rgb/image_raw": SIZE, "/dvs/image_raw": SIZE}, "/dvs/image_raw"),
        ({"/rgb/image_raw": (64, 48), "/dvs/image_raw": SIZE}, "/dvs/image_raw"),
        ({"/dvs/preview": (20, 15), "/dvs/image_raw": SIZE, "/rgb/image_raw": SIZE}, "/dvs/image_raw"),
        ({"/rgb/image_raw": (64, 48), "/frames/image_raw": SIZE}, "/frames/image_raw"),
        ({"/rgb/image_raw": (64, 48)}, "/rgb/image_raw"),
        ({}, None),
    ],
)
def test_frames_are_those_of_the_camera_of_the_events(
    suffix: str, images: dict[str, tuple[int, int]], expected: str | None, tmp_path: Path
):
    library, shades = Library(tmp_path / f"a{suffix}"), {topic: shade for shade, topic in enumerate(images)}
    pictures = [
        library.image(np.full((height, width), shades[topic], np.uint8), 0, topic)
        for topic, (width, height) in images.items()
    ]
    path = library.write([*pictures, library.array(some_events(9), SIZE)])
    found = [int(image[0, 0]) for _, image in format_of(path).codec.frames(path)]
    assert found == ([] if expected is None else [shades[expected]])


def test_each_of_two_cameras_has_its_own_frames_or_none(tmp_path: Path):
    library = Library(tmp_path / "a.bag")
    events = [library.array(some_events(9), SIZE, f"/davis/{name}/events") for name in ("left", "right")]
    images = {"/image_raw": 1, "/davis/image_raw": 2, "/davis/right/image_raw": 3}
    pictures = [library.image(np.full(SIZE[::-1], shade, np.uint8), 0, topic) for topic, shade in images.items()]
    path = library.write([*pictures, *events])
    for name, expected in {"left": [], "right": [3]}.items():
        assert [int(image[0, 0]) for _, image in bag.frames(path, name)] == expected
