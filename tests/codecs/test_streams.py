"""Files that are read and written part by part."""

import struct
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from evslip.codecs import open_events, read_events, source, write_events
from evslip.codecs.inivation import aedat4
from evslip.codecs.inivation.flatbuffer import Vector, buffer
from evslip.codecs.writers import writing
from evslip.data.record_file import read_recording
from evslip.events.stream import Events, concatenate
from evslip.exchange.format_to_format import convert_format
from evslip.exchange.selection import Selection
from evslip.utils.errors import DataError
from foreign_files import aedat2
from sample_records import assert_equal, random_events

STREAMED = [".h5", ".aedat4", ".raw", ".evt2.raw", ".dat", ".es", ".csv", ".txt"]


@pytest.fixture(autouse=True)
def small_parts(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(source, "BLOCK_BYTES", 1024)
    monkeypatch.setattr("evslip.codecs.arrays.hdf5.BLOCK_EVENTS", 100)
    monkeypatch.setattr("evslip.codecs.inivation.aedat4_sink._PACKET", 300)


def long_stream(count: int, seed: int = 0) -> Events:
    """Times that wrap the counters of EVT 3.0, and pauses."""
    rng = np.random.default_rng(seed)
    steps = rng.choice(np.array([0, 0, 1, 30, 5000, 200_000]), count)
    return random_events(rng, count, labelled=False).replace(t_us=np.cumsum(steps).astype(np.int64))


@pytest.mark.parametrize("suffix", STREAMED)
def test_parts_are_the_whole(tmp_path: Path, suffix: str):
    events = long_stream(2000)
    write_events(tmp_path / f"a{suffix}", events, (40, 30))
    parts = list(open_events(tmp_path / f"a{suffix}").parts)
    assert len(parts) > 3
    assert max(part.count for part in parts) < 1000
    assert_equal(concatenate(parts), events)


@pytest.mark.parametrize("suffix", STREAMED)
def test_the_bytes_do_not_depend_on_the_pieces(tmp_path: Path, suffix: str):
    events = long_stream(2000)
    for name, edges in {"a": [0, 2000], "b": [0, 0, 1, 2, 700, 700, 1999, 2000]}.items():
        with writing(tmp_path / f"{name}{suffix}", (40, 30)) as push:
            for start, end in pairwise(edges):
                push(events.select(slice(start, end)))
    assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()


@pytest.mark.parametrize("suffix", [".dat", ".csv", ".h5", ".aedat4"])
def test_disorder_between_two_parts_is_found(tmp_path: Path, suffix: str, monkeypatch: pytest.MonkeyPatch):
    events = long_stream(900)
    events.t_us[600:] -= events.t_us[600]
    with monkeypatch.context() as careless:
        careless.setattr("evslip.codecs.writers.StreamChecker.check", lambda self, part: None)
        careless.setattr("evslip.codecs.arrays.hdf5.check_events", lambda *_: None)
        write_events(tmp_path / f"a{suffix}", events, (40, 30))
    with pytest.raises(DataError, match=r"events/t: event 600 at 0 us comes after .* never decrease"):
        read_events(tmp_path / f"a{suffix}")


@pytest.mark.parametrize("suffix", STREAMED)
def test_disorder_between_two_pieces_is_not_written(tmp_path: Path, suffix: str):
    events = long_stream(20).replace(t_us=np.arange(20))
    with pytest.raises(DataError, match="never decrease"), writing(tmp_path / f"a{suffix}", (40, 30)) as push:
        push(events.select(slice(10, 20)))
        push(events.select(slice(0, 10)))
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", STREAMED)
def test_a_conversion_in_parts_is_one_of_the_whole(tmp_path: Path, suffix: str):
    events = long_stream(2000)
    seconds = int(events.t_us[-1]) / 1e6
    write_events(tmp_path / f"a{suffix}", events, (40, 30))
    part = Selection((3, 2, 30, 20), (0.2 * seconds, 0.7 * seconds), "on", from_zero=True, rotate=90, flip="x")
    done = convert_format(tmp_path / f"a{suffix}", tmp_path / "b.csv", part)
    after = (events.t_us >= round(0.2 * seconds * 1e6)) & (events.t_us < round(0.7 * seconds * 1e6)) & events.p
    kept = events.select(after & (events.x >= 3) & (events.x < 33) & (events.y >= 2) & (events.y < 22))
    assert 0 < kept.count == done.events == done.on
    # Clockwise: the left column becomes the top row; then mirrored, so that the top row becomes the left column.
    expected = kept.replace(t_us=kept.t_us - kept.t_us[0], x=kept.y - np.uint16(2), y=kept.x - np.uint16(3))
    assert_equal(read_events(tmp_path / "b.csv"), expected)
    assert done.size == (20, 30)


def test_a_slice_ends_the_reading(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    write_events(tmp_path / "a.dat", long_stream(5000), (40, 30))
    seen = []

    def counted(path: Path, camera: str | None) -> source.Source:
        opened = open_events(path, camera)

        def parts() -> Iterator[Events]:
            for part in opened.parts:
                seen.append(part.count)
                yield part

        return opened._replace(parts=parts())

    monkeypatch.setattr("evslip.exchange.format_to_format.open_events", counted)
    convert_format(tmp_path / "a.dat", tmp_path / "b.dat", Selection(slice_s=(0, 1)))
    assert 0 < sum(seen) < 1000


@pytest.mark.parametrize("rotate", [0, 90, 180, 270])
@pytest.mark.parametrize("flip", [None, "x", "y"])
def test_events_and_pictures_are_turned_alike(rotate: int, flip):
    from evslip.exchange.selector import Selector

    image = np.arange(30 * 40).reshape(30, 40)
    selector = Selector(Selection((5, 4, 20, 12), rotate=rotate, flip=flip), (40, 30))
    turned = selector.image(image)
    assert turned.shape == selector.size[::-1]
    y, x = (part.ravel().astype(np.uint16) for part in np.indices((30, 40)))
    events = selector.events(Events(np.arange(1200), x, y, np.ones(1200, bool)), 0)
    assert events.count == 240
    np.testing.assert_array_equal(turned[events.y, events.x], events.t_us)


def test_a_line_without_end_is_refused(tmp_path: Path):
    (tmp_path / "a.csv").write_bytes(b"t_us,x,y,p\n" + b"1" * 5000)
    with pytest.raises(DataError, match="a line never ends"):
        read_events(tmp_path / "a.csv")


def frame_buffer(t_us: int, image: np.ndarray, kind: int) -> bytes:
    return buffer(
        b"FRME",
        struct.pack("<q", t_us),
        *(bytes(8) for _ in range(4)),
        struct.pack("<i", kind),
        *(struct.pack("<i", side) for side in (image.shape[1], image.shape[0], 0, 0)),
        Vector(image.size, image.tobytes()),
    )


def test_frames_of_aedat4_are_read():
    from evslip.codecs.inivation.flatbuffer import Table

    rng = np.random.default_rng(0)
    for kind, channels in ((0, 1), (16, 3), (24, 4)):
        image = rng.integers(0, 256, (6, 9, channels), np.uint8)
        table = Table.root(memoryview(frame_buffer(123, image, kind))[4:], b"FRME")
        t_us, read = aedat4._frame(table)
        assert t_us == 123
        np.testing.assert_array_equal(read, image[..., 0] if channels == 1 else image[..., [2, 1, 0]])
    with pytest.raises(ValueError, match="8-bit"):
        aedat4._frame(Table.root(memoryview(frame_buffer(0, image, 2))[4:], b"FRME"))


@pytest.mark.parametrize("name", ["aedat", "dv_processing"])
def test_written_aedat4_agrees_with_an_independent_reader(tmp_path: Path, name: str):
    library = pytest.importorskip(name)
    events = long_stream(5000)
    write_events(tmp_path / "a.aedat4", events, (40, 30))
    if name == "aedat":
        rows = np.concatenate([p["events"] for p in library.Decoder(str(tmp_path / "a.aedat4")) if "events" in p])
        names = ("t", "x", "y", "on")
    else:
        recording, batches = library.io.MonoCameraRecording(str(tmp_path / "a.aedat4")), []
        while (batch := recording.getNextEventBatch()) is not None:
            batches.append(batch.numpy())
        rows, names = np.concatenate(batches), ("timestamp", "x", "y", "polarity")
    for mine, theirs in zip(events.columns, names, strict=True):
        np.testing.assert_array_equal(mine, rows[theirs])


@pytest.mark.parametrize(
    ("size", "header"), [((346, 260), b""), ((240, 180), b"# AEChip: ch.unizh.ini.davis.DAVIS240C\r\n")]
)
def test_aedat2_is_read(tmp_path: Path, size: tuple[int, int], header: bytes):
    events = random_events(np.random.default_rng(0), 700, size, labelled=False)
    content = aedat2(events, size, header)
    special = struct.pack(">4I", 1 << 31 | 5, 9, 1 << 10, 9)  # a sample of a frame, and a special event
    (tmp_path / "a.aedat").write_bytes(content[:-80] + special + content[-80:])
    recording = read_recording(tmp_path / "a.aedat")
    assert recording.size == size
    assert_equal(recording.events, events)


@pytest.mark.parametrize("last", [b"", b"#End Of ASCII Header\r\n"])
@pytest.mark.parametrize(
    ("address", "t_us"),
    [
        (0x23_04_68_00, 5),  # y 140; no end of a line comes soon
        (0x23_04_0A_00, 5),  # one within the address
        (0x23_41_0A_00, 5),  # and before it only text
        (0x23_41_48_0A, 5),
        (0x23_41_48_20, 0x0A_00_00_00),  # one within the time, of 168 s
    ],
)
def test_events_of_aedat2_may_begin_like_a_line_of_the_header(tmp_path: Path, address: int, t_us: int, last: bytes):
    words = np.array([[address, t_us + k] for k in range(3)], ">u4")
    header = b"#!AER-DAT2.0\r\n# Creation time: M\xc3\xa4rz\r\n#\r\n" + last
    (tmp_path / "a.aedat").write_bytes(header + words.tobytes())
    events = read_events(tmp_path / "a.aedat")
    assert events.t_us.tolist() == [t_us, t_us + 1, t_us + 2]
    assert set(events.y.tolist()) == {259 - (address >> 22)}


def test_an_aedat2_file_without_a_whole_line_is_refused(tmp_path: Path):
    for rest in (b"", b"\r", b" and no more", b"\x00\x01\n"):
        (tmp_path / "a.aedat").write_bytes(b"#!AER-DAT2.0" + rest)
        with pytest.raises(DataError, match=r"a\.aedat: (truncated|damaged) in the header"):
            read_events(tmp_path / "a.aedat")


def test_aedat2_of_a_dvs128_is_read(tmp_path: Path):
    words = np.array([[3 << 8 | 7 << 1, 10], [1 << 15, 11], [127 << 8 | 0 << 1 | 1, 12]], ">u4")
    (tmp_path / "a.aedat").write_bytes(b"#!AER-DAT2.0\n# chip DVS128\n" + words.tobytes())
    recording = read_recording(tmp_path / "a.aedat")
    x, y = (np.array(c, np.uint16) for c in ([120, 127], [124, 0]))
    assert_equal(recording.events, Events(np.array([10, 12]), x, y, np.array([True, False])))
    assert recording.size == (128, 128)


def test_other_versions_of_aedat_are_refused(tmp_path: Path):
    (tmp_path / "a.aedat").write_bytes(b"#!AER-DAT3.1\r\n# more\r\n")
    with pytest.raises(DataError, match=r"version '3.1' of AEDAT"):
        read_events(tmp_path / "a.aedat")


def test_an_aedat4_file_whose_packets_end_before_they_begin_is_refused(tmp_path: Path):
    path = tmp_path / "a.aedat4"
    write_events(path, random_events(np.random.default_rng(0), 50, labelled=False), (40, 30))
    whole, end = path.read_bytes(), aedat4._header(path).end
    for place in (0, 5):
        path.write_bytes(whole.replace(struct.pack("<q", end), struct.pack("<q", place), 1))
        with pytest.raises(DataError, match=f"its packets end at byte {place}, before they begin"):
            read_events(path)


def test_an_aedat4_header_in_an_unknown_encoding_is_refused(tmp_path: Path):
    path = tmp_path / "a.aedat4"
    write_events(path, random_events(np.random.default_rng(0), 50, labelled=False), (40, 30))
    whole = path.read_bytes()
    begin, end = whole.index(b"<dv "), whole.index(b"</dv>") + len(b"</dv>")
    text = b'<?xml version="1.0" encoding="none"?><dv/>'.ljust(end - begin)
    path.write_bytes(whole[:begin] + text + whole[end:])
    with pytest.raises(DataError, match="damaged AEDAT4 file: unknown encoding"):
        read_events(path)


def test_mutated_aedat2_raises_data_errors(tmp_path: Path):
    events = random_events(np.random.default_rng(0), 60, labelled=False)
    whole, path, rng = aedat2(events, (346, 260)), tmp_path / "mutated.aedat", np.random.default_rng(1)
    for _ in range(60):
        mutated = np.frombuffer(whole, np.uint8).copy()
        mutated[rng.integers(0, len(whole), 3)] = rng.integers(0, 256, 3)
        path.write_bytes(mutated.tobytes()[: None if rng.random() < 0.7 else rng.integers(1, len(whole))])
        try:
            read_events(path)
        except DataError as error:
            assert str(error).startswith(str(path))
            assert "\n" not in str(error)


@pytest.mark.parametrize(
    ("attributes", "size"),
    [
        ({"geometry": "1280x720"}, (1280, 720)),
        ({"geometry": np.bytes_("1280x720")}, (1280, 720)),
        ({"width": "640", "height": "480"}, (640, 480)),
        ({"width": 640, "height": 480}, (640, 480)),
        ({"format": "EVT3;height=720;width=1280"}, (1280, 720)),
        ({"format": "EVT3"}, None),
    ],
)
def test_tables_of_metavision_are_read(tmp_path: Path, attributes: dict[str, Any], size: tuple[int, int] | None):
    events = long_stream(300)
    rows = np.zeros(300, np.dtype([("x", "<u2"), ("y", "<u2"), ("p", "<i2"), ("t", "<i8")]))
    for name, column in zip("txyp", events.columns, strict=True):
        rows[name] = column
    with h5py.File(tmp_path / "a.hdf5", "w") as file:
        file.create_dataset("CD/events", data=rows, compression="gzip")
        file.attrs.update(attributes)
    assert_equal(read_recording(tmp_path / "a.hdf5").events, events)
    assert open_events(tmp_path / "a.hdf5").size == size


@pytest.mark.parametrize(
    "attributes", [{"geometry": "widexhigh"}, {"width": "640"}, {"format": "EVT3;height=-1;width=2"}]
)
def test_a_size_of_metavision_that_cannot_be_is_refused(tmp_path: Path, attributes: dict[str, Any]):
    with h5py.File(tmp_path / "a.hdf5", "w") as file:
        file.create_dataset("CD/events", data=np.zeros(1, np.dtype([(name, "<i8") for name in "xypt"])))
        file.attrs.update(attributes)
    with pytest.raises(DataError, match=r"a\.hdf5: the sensor's size is .*, expected one such as 640x480"):
        open_events(tmp_path / "a.hdf5")


def test_the_filter_that_is_missing_is_named(tmp_path: Path):
    with h5py.File(tmp_path / "a.hdf5", "w") as file:
        plist = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        plist.set_chunk((10,))
        plist.set_filter(36559, h5py.h5z.FLAG_OPTIONAL)
        dtype = h5py.h5t.py_create(np.dtype([("x", "<u2"), ("y", "<u2"), ("p", "<i2"), ("t", "<i8")]))
        h5py.h5d.create(file.create_group("CD").id, b"events", dtype, h5py.h5s.create_simple((10,)), plist)
    with pytest.raises(DataError, match=r"filter ECF \(36559\).*hdf5_ecf.*HDF5_PLUGIN_PATH"):
        read_events(tmp_path / "a.hdf5")


def test_frames_of_an_independent_writer_are_read(tmp_path: Path):
    library = pytest.importorskip("dv_processing")
    config = library.io.MonoCameraWriter.Config("DAVIS346")
    config.addEventStream((40, 30))
    config.addFrameStream((40, 30))
    writer = library.io.MonoCameraWriter(str(tmp_path / "a.aedat4"), config)
    store = library.EventStore()
    store.push_back(1000, 7, 3, True)
    writer.writeEvents(store)
    rng = np.random.default_rng(0)
    grey, colour = rng.integers(0, 256, (30, 40), np.uint8), rng.integers(0, 256, (30, 40, 3), np.uint8)
    writer.writeFrame(library.Frame(2000, grey))
    writer.writeFrame(library.Frame(3000, colour))
    del writer
    (t0, first), (t1, second) = aedat4.frames(tmp_path / "a.aedat4")
    assert (t0, t1) == (2000, 3000)
    np.testing.assert_array_equal(first, grey)
    np.testing.assert_array_equal(second, colour[..., ::-1])
    assert read_events(tmp_path / "a.aedat4").x.tolist() == [7]
