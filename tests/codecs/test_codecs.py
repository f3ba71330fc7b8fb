import bz2
import io
import resource
import struct
import zipfile
import zlib
from pathlib import Path

import h5py
import lz4.frame
import numpy as np
import pytest
import scipy.io
import zstandard
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from evslip import codecs
from evslip.codecs import open_events, read_events, source, write_events
from evslip.codecs.arrays import mat
from evslip.codecs.facts import examine
from evslip.codecs.ros import bag
from evslip.data import record_file
from evslip.data.record_file import read_recording
from evslip.events.stream import FIELDS, Events
from evslip.exchange.importing.recordings import import_recording
from evslip.utils.errors import DataError
from sample_records import assert_equal, random_events, simulated
from shared_data import shared

BAGS = (".bag", ".db3", ".mcap")
WRITABLE = [suffix for suffix in codecs.known_suffixes(writing=True) if suffix not in BAGS]
"""All but bags, which tests/exchange/test_sample_bag.py writes."""
LABELS_KEPT = {".h5", ".hdf5", ".npz"}
SIZE_LOST = {".csv", ".txt", ".mat"}
LATEST_US = {".raw": 2**40, ".dat": 2**32, ".es": 2**34, ".txt": 2**52}
"""Formats whose times are from 0 to just below."""
CUT_BETWEEN_EVENTS = {".csv", ".txt", ".raw", ".dat", ".es"}
"""Formats that do not say how many events there are."""


def aedat4(events: Events, size: tuple[int, int] = (40, 30), compression: int = 1, packets: int = 3) -> bytes:
    """A file as the format's description has it, with a stream of another kind between the packets of events."""

    def table(identifier: bytes, fields: list[tuple[bytes, bytes | None]]) -> bytes:
        # Size prefix, root offset, identifier, vtable, table, then what the table's offsets point to.
        vtable_bytes = 4 + 2 * len(fields)
        start = 8 + vtable_bytes + (-vtable_bytes) % 4
        offsets, inline, position = [], b"", 4
        tail_at = start + 4 + sum(len(value) if tail is None else 4 for value, tail in fields)
        tails = b""
        for value, tail in fields:
            offsets.append(position)
            if tail is None:
                inline += value
            else:
                inline += struct.pack("<I", tail_at + len(tails) - (start + position))
                tails += tail
            position = 4 + len(inline)
        vtable = struct.pack(f"<HH{len(fields)}H", vtable_bytes, position, *offsets)
        body = struct.pack("<I4s", start, identifier) + vtable.ljust(start - 8, b"\0")
        body += struct.pack("<i", start - 8) + inline + tails
        return struct.pack("<I", len(body)) + body

    def packet(part: Events) -> bytes:
        rows = np.zeros(part.count, np.dtype("<i8, <i2, <i2, u1, V3"))
        for name, column in zip(rows.dtype.names or (), part.columns, strict=False):
            rows[name] = column
        plain = table(b"EVTS", [(b"", struct.pack("<I", part.count) + rows.tobytes())])
        return {
            0: lambda: plain,
            1: lambda: lz4.frame.compress(plain),
            3: lambda: zstandard.ZstdCompressor().compress(plain),
        }[compression]()

    xml = f"""<dv version="2.0"><node name="outInfo" path="/o/">
        <node name="0" path="/o/0/"><attr key="typeIdentifier" type="string">IMUS</attr></node>
        <node name="4" path="/o/4/"><attr key="typeIdentifier" type="string">EVTS</attr>
        <node name="info" path="/o/4/info/"><attr key="sizeX" type="int">{size[0]}</attr>
        <attr key="sizeY" type="int">{size[1]}</attr></node></node></node></dv>""".encode()
    body = b""
    for part in np.array_split(np.arange(events.count), packets):
        data = packet(events.select(part))
        body += struct.pack("<iI", 4, len(data)) + data + struct.pack("<iI", 0, 5) + b"other"
    string = struct.pack("<I", len(xml)) + xml + b"\0"
    # Compression and position come with a fixed size, so the header can be made twice.
    length = len(table(b"IOHE", [(bytes(4), None), (bytes(8), None), (b"", string)]))
    end = struct.pack("<q", 14 + length + len(body))
    header = table(b"IOHE", [(struct.pack("<i", compression), None), (end, None), (b"", string)])
    return b"#!AER-DAT4.0\r\n" + header + body + b"a table of the packets, not needed"


@pytest.fixture
def events() -> Events:
    return random_events(np.random.default_rng(0), 500)


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(0, 2**32), st.sampled_from([0, 1, 400]), st.integers(-(2**40), 2**60), st.booleans())
@pytest.mark.parametrize("suffix", WRITABLE)
def test_what_is_read_is_what_was_written(
    tmp_path: Path, suffix: str, seed: int, count: int, start: int, labelled: bool
):
    events = random_events(np.random.default_rng(seed), count, labelled=labelled)
    if suffix in LATEST_US:  # not too late: some have words that only let the time pass
        start = start % min(LATEST_US[suffix] - 50_000, 2**30)
    events = events.replace(t_us=events.t_us + start)
    path = tmp_path / f"a{suffix.upper()}"
    write_events(path, events, (40, 30))
    expected = events if suffix in LABELS_KEPT else events.replace(body=None, cause=None)
    assert_equal(read_events(path), expected)
    if suffix not in SIZE_LOST:
        assert read_recording(path).size == (40, 30)


@pytest.mark.parametrize("suffix", WRITABLE)
def test_the_same_events_give_the_same_bytes(tmp_path: Path, suffix: str, events: Events):
    for name in "ab":
        write_events(tmp_path / f"{name}{suffix}", events)
    assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()


def test_streams_that_last_longer_than_an_hour_keep_their_times(tmp_path: Path):
    t_us = np.array([-5, 0, 2**32, 2**50], np.int64)
    events = Events(t_us, *(np.zeros(4, np.uint16) for _ in "xy"), np.ones(4, bool))
    write_events(tmp_path / "a.h5", events)
    assert_equal(read_events(tmp_path / "a.h5"), events)


def test_files_of_dsec_are_read(tmp_path: Path, events: Events):
    # As the data set's own files: no attributes, uint32 times after an offset, another compression.
    with h5py.File(tmp_path / "dsec.h5", "w") as file:
        for name, values in {"x": events.x, "y": events.y, "t": events.t_us.astype(np.uint32), "p": events.p}.items():
            file.create_dataset(f"events/{name}", data=values.astype(np.uint8 if name == "p" else values.dtype))
        file["t_offset"] = np.int64(49_599_000_000)
        file["ms_to_idx"] = np.zeros(3, np.uint64)
    read = read_events(tmp_path / "dsec.h5")
    assert_equal(read, Events(events.t_us + 49_599_000_000, *events.columns[1:]))


def test_a_record_can_be_read_as_events_and_as_itself(tmp_path: Path):
    sample = simulated()
    record_file.write(tmp_path / "a.h5", sample)
    assert_equal(read_events(tmp_path / "a.h5"), sample.events)
    assert_equal(read_recording(tmp_path / "a.h5"), sample)


@pytest.mark.parametrize("compression", [0, 1, 3])
@pytest.mark.parametrize("count", [0, 1, 500])
def test_aedat4_is_read(tmp_path: Path, compression: int, count: int):
    events = random_events(np.random.default_rng(0), count, labelled=False)
    (tmp_path / "a.aedat4").write_bytes(aedat4(events, compression=compression))
    recording = read_recording(tmp_path / "a.aedat4")
    assert_equal(recording.events, events)
    assert (recording.kind, recording.name, recording.size) == ("recording", "a", (40, 30))


def test_a_real_recording_agrees_with_independent_readers(tmp_path: Path):
    path = shared("real", "dvxplorer.aedat4")
    recording = import_recording(path, tmp_path / "out.h5")
    events = recording.events
    assert_equal(record_file.read(tmp_path / "out.h5"), recording)
    events = read_events(path)
    np.testing.assert_array_equal(recording.events.t_us, events.t_us - events.t_us[0])
    # As dv-processing 2.0.4 and aedat 2.3.0 give them.
    assert (events.count, recording.size) == (111_954, (320, 240))
    rows = [tuple(int(column[i]) for column in events.columns) for i in (0, 1, 2, -3, -2, -1)]
    assert rows == [
        (1605537493718345, 154, 204, 0),
        (1605537493718348, 149, 206, 0),
        (1605537493718349, 148, 199, 1),
        (1605537494308260, 92, 194, 0),
        (1605537494308261, 90, 132, 0),
        (1605537494308262, 88, 237, 1),
    ]
    assert (np.diff(events.t_us) >= 0).all()
    assert (int(events.x.max()), int(events.y.max())) == (319, 239)
    assert (tmp_path / "out.h5").stat().st_size / events.count <= 3.5


@pytest.mark.parametrize("name", ["aedat", "dv_processing"])
def test_a_real_recording_agrees_event_by_event(name: str):
    path = shared("real", "dvxplorer.aedat4")
    library = pytest.importorskip(name)
    if name == "aedat":
        rows = np.concatenate([packet["events"] for packet in library.Decoder(str(path)) if "events" in packet])
        columns = [rows["t"], rows["x"], rows["y"], rows["on"]]
    else:
        recording, batches = library.io.MonoCameraRecording(str(path)), []
        while (batch := recording.getNextEventBatch()) is not None:
            batches.append(batch.numpy())
        rows = np.concatenate(batches)
        columns = [rows["timestamp"], rows["x"], rows["y"], rows["polarity"]]
    for mine, theirs in zip(read_events(path).columns, columns, strict=True):
        np.testing.assert_array_equal(mine, theirs)


def whole_files(tmp_path: Path, events: Events) -> dict[str, bytes]:
    files = {".aedat4": aedat4(events, compression=1), ".zstd.aedat4": aedat4(events, compression=3)}
    for suffix in WRITABLE:
        write_events(tmp_path / f"whole{suffix}", events)
        files[suffix] = (tmp_path / f"whole{suffix}").read_bytes()
    return files


@pytest.mark.parametrize("suffix", [*WRITABLE, ".aedat4"])
def test_every_truncation_is_refused_or_a_part_of_the_whole(tmp_path: Path, suffix: str):
    events = random_events(np.random.default_rng(0), 60, labelled=False)
    whole = whole_files(tmp_path, events)[suffix]
    path = tmp_path / f"cut{suffix}"
    accepted = 0
    for length in range(0, len(whole), 1 if len(whole) < 3000 else 7):
        path.write_bytes(whole[:length])
        try:
            read = read_events(path)
        except DataError as error:
            assert str(path) in str(error)
            assert "\n" not in str(error)
        else:  # cut between two events, or in the table at the end of an AEDAT4 file
            accepted += 1
            assert_equal(read, events.select(slice(read.count)))
            assert suffix in CUT_BETWEEN_EVENTS or read.count == events.count
    assert accepted == 0 or suffix in {".aedat4"} | CUT_BETWEEN_EVENTS


def test_mutated_files_raise_data_errors_or_give_valid_events(tmp_path: Path):
    files = whole_files(tmp_path, random_events(np.random.default_rng(0), 300))
    rng = np.random.default_rng(1)
    for suffix, whole in files.items():
        path = tmp_path / f"mutated{suffix}"
        for _ in range(200):
            mutated = np.frombuffer(whole, np.uint8).copy()
            where = rng.integers(0, len(whole), rng.integers(1, 6))
            mutated[where] = rng.choice(np.array([0, 1, 127, 128, 255, rng.integers(256)], np.uint8), len(where))
            path.write_bytes(mutated.tobytes())
            try:
                read = read_events(path)
            except DataError as error:
                assert str(path) in str(error)
                assert "\n" not in str(error)
            else:
                assert (np.diff(read.t_us) >= 0).all()


@pytest.mark.parametrize("suffix", codecs.known_suffixes())
@pytest.mark.parametrize(
    "content", [b"", b"\0", b"garbage \xff\n" * 50, b"PK\x03\x04" + b"\0" * 60, b"#!AER-DAT4.0\r\n"]
)
def test_what_is_of_no_format_is_refused(tmp_path: Path, suffix: str, content: bytes):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(content)
    with pytest.raises(DataError) as caught:
        read_events(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_bombs_are_refused(tmp_path: Path):
    zeros = Events(np.zeros(10**7, np.int64), *(np.zeros(10**7, np.uint16) for _ in "xy"), np.zeros(10**7, bool))
    (tmp_path / "bomb.aedat4").write_bytes(aedat4(zeros, compression=3, packets=1))
    with pytest.raises(DataError, match="beyond all bounds"):
        read_events(tmp_path / "bomb.aedat4")


def test_a_chunk_of_a_bag_unpacks_to_so_much_at_most(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(bag, "LARGEST_CHUNK", 1 << 20)
    for pack in (bz2.compress, lz4.frame.compress):
        unpack = bag.bounded(bz2.decompress if pack is bz2.compress else lz4.frame.decompress)
        assert unpack(pack(bytes(1 << 20))) == bytes(1 << 20)
        with pytest.raises(ValueError, match="beyond all bounds"):
            unpack(pack(bytes((1 << 20) + 1)))


def test_an_archive_that_claims_too_much_is_refused(tmp_path: Path):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_BZIP2) as archive:
        archive.writestr("t_us.npy", bytes(10**8))
    (tmp_path / "bomb.npz").write_bytes(buffer.getvalue())
    with pytest.raises(DataError, match="more than can be packed"):
        read_events(tmp_path / "bomb.npz")


@pytest.mark.parametrize("suffix", [".npz", ".h5"])
def test_a_whole_sensor_that_flickers_is_read_again(tmp_path: Path, suffix: str, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(source, "MOST_ANYWAY", 1000)
    frames, (width, height) = 40, (240, 180)
    y, x = (np.tile(side.ravel(), frames).astype(np.uint16) for side in np.mgrid[:height, :width])
    number = np.arange(frames).repeat(width * height)
    events = Events(number * 10_000, x, y, number % 2 == 0)
    write_events(tmp_path / f"a{suffix}", events, (width, height))
    assert events.count > source.MOST_A_BYTE * (tmp_path / f"a{suffix}").stat().st_size
    assert_equal(read_events(tmp_path / f"a{suffix}"), events)


@pytest.mark.parametrize("suffix", [".npz", ".h5"])
def test_a_small_file_of_endless_events_is_refused_by_its_shapes(tmp_path: Path, suffix: str):
    n = 30_000_000
    path = tmp_path / f"bomb{suffix}"
    kinds = {"t": np.uint32, "x": np.uint16, "y": np.uint16, "p": np.uint8}
    if suffix == ".npz":
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, dtype in {"t_us": np.int64, "x": np.uint16, "y": np.uint16, "p": np.bool_}.items():
                header = io.BytesIO()
                descr = np.lib.format.dtype_to_descr(np.dtype(dtype))
                np.lib.format.write_array_header_1_0(header, {"descr": descr, "fortran_order": False, "shape": (n,)})
                archive.writestr(f"{name}.npy", header.getvalue() + bytes(n * np.dtype(dtype).itemsize))
            size = io.BytesIO()
            np.save(size, np.array([40, 30]))
            archive.writestr("size.npy", size.getvalue())
    else:
        with h5py.File(path, "w") as file:
            for name, dtype in kinds.items():
                file.create_dataset(f"events/{name}", data=np.zeros(n, dtype), compression="gzip")
    assert path.stat().st_size < n / 8
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for reader in (read_events, open_events, examine):
        with pytest.raises(DataError, match=r"30,000,000 events or more in .* packed beyond all bounds"):
            reader(path)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 50_000  # kB


@pytest.mark.parametrize(
    "text",
    [
        "t_us,x,y,p\n5,7,3,1\n9,8,4,0\n",
        "5,7,3,1\n9,8,4,0\n",
        " 5, 7, 3, 1\r\n 9, 8, 4, 0",
        "5,7,3,1\n9,8,4,-1\n",
        "t,x,y,p\n5,7,3,1\n9,8,4,0\n",
        '\ufeffx,y,"timestamp","polarity"\n7,3,5,1\n8,4,9,0\n',
    ],
)
def test_csv_is_read_with_its_head_and_without(tmp_path: Path, text: str):
    (tmp_path / "a.csv").write_bytes(text.encode())
    events = Events(np.array([5, 9]), np.array([7, 8], "u2"), np.array([3, 4], "u2"), np.array([True, False]))
    assert_equal(read_events(tmp_path / "a.csv"), events)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x,y\n", "expected the line t_us,x,y,p"),
        ("t_us,x,y,p\n1,2,3\n", "four columns"),
        ("t_us,x,y,p\n1,2,3,2\n", "four columns"),
        ("1,2,3\n", "four columns"),
        ("1,2,3,1,0\n", "four columns"),
        ("0.001,2,3,1\n", "not a table"),
        ("time,x,y,p\n1,2,3,1\n", "begins with 'time,x,y,p', expected the line t_us,x,y,p, or four whole numbers"),
        ("t,x,x,p\n1,2,3,1\n", "begins with"),
        ("", "the file is empty"),
        ("t_us,x,y,p\n1,-2,3,1\n", "four columns"),
        ("t_us,x,y,p\n1,70000,3,1\n", "four columns"),
        ("t_us,x,y,p\n1,2,3,up\n", "not a table"),
        ("t_us,x,y,p\n5,2,3,1\n4,2,3,1\n", "never decrease"),
    ],
)
def test_text_that_is_no_table_of_events_is_refused(tmp_path: Path, text: str, message: str):
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(DataError, match=message):
        read_events(tmp_path / "a.csv")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("0.1 2 3\n", "3 columns, expected four"),
        ("0.1 2 3 1\n0.2 2 3 2\n", "event 1 is 0.2 2 3 2, expected"),
        ("0.1 2 3.5 1\n", "event 0 is 0.1 2 3.5 1"),
        ("0.1 -2 3 1\n", "event 0"),
        ("0.1 70000 3 1\n", "event 0"),
        ("nan 2 3 1\n", "event 0"),
        ("1e300 2 3 1\n", "event 0"),
        ("0.1 2 3 up\n", "not a table"),
        ("0.5 2 3 1\n0.4 2 3 1\n", "never decrease"),
    ],
)
def test_text_that_v2e_would_not_write_is_refused(tmp_path: Path, text: str, message: str):
    (tmp_path / "a.txt").write_text(text)
    with pytest.raises(DataError, match=message):
        read_events(tmp_path / "a.txt")


def test_text_of_v2e_is_read(tmp_path: Path):
    header = "#!events.txt\n# This is a text DVS created by v2e\n# timestamp x y polarity\n"
    (tmp_path / "a.txt").write_text(header + "0.0000015 7 3 1\n1e-3 2 5 0\n3.5 1 1 -1\n")
    t_us, x, y = [2, 1000, 3_500_000], [7, 2, 1], [3, 5, 1]
    expected = Events(np.array(t_us), np.array(x, np.uint16), np.array(y, np.uint16), np.array([True, False, False]))
    assert_equal(read_events(tmp_path / "a.txt"), expected)
    write_events(tmp_path / "b.txt", expected)
    assert (tmp_path / "b.txt").read_text() == "# t[s] x y p\n0.000002 7 3 1\n0.001000 2 5 0\n3.500000 1 1 0\n"


def test_arrays_that_are_missing_or_pickled_are_refused(tmp_path: Path, events: Events):
    columns = {name: getattr(events, name) for name in FIELDS if name != "p"}
    np.savez(tmp_path / "a.npz", size=[40, 30], **columns)
    with pytest.raises(DataError, match="expected the arrays"):
        read_events(tmp_path / "a.npz")
    np.savez(tmp_path / "b.npz", size=[40, 30], p=np.array([{}], object), **columns)
    with pytest.raises(DataError, match=r"b\.npz: p: holds Python objects"):
        read_events(tmp_path / "b.npz")


def test_events_beyond_the_sensor_are_not_written(tmp_path: Path, events: Events):
    for suffix in WRITABLE:
        with pytest.raises(DataError, match="out of range"):
            write_events(tmp_path / f"a{suffix}", events, (10, 10))
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["a.mp4", "a", "a.h5.bak"])
def test_an_unknown_suffix_lists_the_known_ones(tmp_path: Path, name: str, events: Events):
    (tmp_path / name).write_text("x")
    with pytest.raises(DataError, match=r"read; known are .*\.aedat4"):
        read_events(tmp_path / name)
    with pytest.raises(
        DataError,
        match=r"written; known are \.h5, \.hdf5, \.aedat4, \.raw, \.dat, \.es, .*\.csv, \.txt, \.mat, \.bag, .*\.mcap$",
    ):
        write_events(tmp_path / name, events)


def test_formats_that_cannot_be_written_say_so(tmp_path: Path, events: Events):
    with pytest.raises(DataError, match="can be written"):
        write_events(tmp_path / "a.aedat", events)


def test_a_recording_is_imported_into_hdf5_only(tmp_path: Path, events: Events):
    write_events(tmp_path / "a.npz", events)
    with pytest.raises(DataError, match=r"must end in \.h5"):
        import_recording(tmp_path / "a.npz", tmp_path / "out.csv")


def test_every_format_has_its_functions():
    for form in codecs.FORMATS:
        assert callable(form.codec.stream)
        assert form.writes == (hasattr(form.codec, "write") or hasattr(form.codec, "Sink"))


def test_mat_files_of_vt_snn_are_read(tmp_path: Path):
    # As MATLAB writes it: doubles; rows or columns.
    table = {"x": [[7.0, 2.0]], "y": [[3.0], [5.0]], "p": [[1.0, -1.0]], "ts": [[10.0, 20.0]]}
    scipy.io.savemat(tmp_path / "a_td.mat", {"td_data": table, "other": "text"})
    expected = Events(np.array([10, 20]), np.array([7, 2], "u2"), np.array([3, 5], "u2"), np.array([True, False]))
    assert_equal(read_events(tmp_path / "a_td.mat"), expected)
    write_events(tmp_path / "b.mat", expected)
    written = scipy.io.loadmat(tmp_path / "b.mat")["td_data"]
    assert {name: written[name][0][0].ravel().tolist() for name in table} == {
        "x": [7, 2],
        "y": [3, 5],
        "p": [1, -1],
        "ts": [10, 20],
    }


def test_mat_files_expand_to_their_limit_and_no_further(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path, plain = tmp_path / "a.mat", struct.pack("<2I", 14, 992) + bytes(992)
    content = zlib.compress(plain)
    elements = struct.pack("<2I", 15, len(content)) + content
    path.write_bytes(bytes(126) + b"IM" + elements * 2)
    for limit, message in ((1000, "its elements expand beyond all bounds"), (2000, "holds no variable td_data")):
        monkeypatch.setattr(mat, "_MOST_ANYWAY", limit)
        monkeypatch.setattr(mat, "_MOST_EXPANDED", 1)
        with pytest.raises(DataError, match=message):
            read_events(path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"ts": [0.1, 1e300]}, "td_data.ts: expected whole numbers .* microseconds"),
        ({"x": [1.0, np.nan]}, "td_data.x: expected whole"),
        ({"x": [1, 70000]}, "td_data.x: expected whole"),
        ({"y": [1]}, "td_data.y: 1 numbers for 2 times"),
        ({"p": "ab"}, "td_data.p are no real numbers"),
        ({"ts": [2, 1]}, "never decrease"),
    ],
)
def test_mat_files_that_hold_no_events_are_refused(tmp_path: Path, change: dict, message: str):
    table = {"x": [1, 2], "y": [1, 2], "p": [1, -1], "ts": [1, 2]}
    scipy.io.savemat(tmp_path / "a.mat", {"td_data": table | change})
    with pytest.raises(DataError, match=message):
        read_events(tmp_path / "a.mat")
    scipy.io.savemat(tmp_path / "a.mat", {"data": table})
    with pytest.raises(DataError, match="td_data of x, y, p and ts"):
        read_events(tmp_path / "a.mat")
