"""Event files that grow while the events are made."""

import errno
import json
import shutil
import sqlite3

import h5py
import numpy as np
import pytest

from evslip.codecs import read_events, read_whole
from evslip.codecs.arrays import hdf5, hdf5_sink, npz
from evslip.codecs.settings import read_settings
from evslip.codecs.writers import writing
from evslip.events.stream import FIELDS, Events
from evslip.utils import atomic
from evslip.utils.errors import DataError, StorageError

SIZE = (346, 260)


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch):
    monkeypatch.setattr(hdf5_sink, "BLOCK", 1000)


def stream(count: int, start_us: int = 0, most_us: int = 30, labelled: bool = False) -> Events:
    rng = np.random.default_rng(count)
    return Events(
        start_us + np.cumsum(rng.integers(0, most_us, count)),
        rng.integers(0, SIZE[0], count).astype(np.uint16),
        rng.integers(0, SIZE[1], count).astype(np.uint16),
        rng.random(count) < 0.5,
        rng.integers(0, 4, count).astype(np.uint8) if labelled else None,
        rng.integers(0, 4, count).astype(np.uint8),
    )


def write(path, events: Events, pieces: int) -> None:
    with writing(path, SIZE, settings='{"seed": 1}') as push:
        for start in range(0, max(events.count, 1), pieces):
            push(events.select(slice(start, start + pieces)))


def assert_equal(a: Events, b: Events) -> None:
    for x, y in ((getattr(a, name), getattr(b, name)) for name in FIELDS):
        assert (x is None) == (y is None)
        if x is not None and y is not None:
            assert x.dtype == y.dtype
            np.testing.assert_array_equal(x, y)


@pytest.mark.parametrize("labelled", [False, True])
@pytest.mark.parametrize("count", [0, 1, 999, 1000, 1001, 7321])
def test_a_grown_file_is_a_file_written_at_once_whatever_the_pieces(count, labelled, tmp_path):
    events = stream(count, labelled=labelled)
    hdf5.write(tmp_path / "whole.h5", events, SIZE)
    for pieces in (1, 333, 1000, 10_000) if count < 2000 else (333, 10_000):
        write(tmp_path / f"{pieces}.h5", events, pieces)
        found, size = read_whole(tmp_path / f"{pieces}.h5")
        assert size == SIZE
        assert_equal(found, events)
        with h5py.File(tmp_path / f"{pieces}.h5") as grown, h5py.File(tmp_path / "whole.h5") as whole:
            for name in ("ms_to_idx", "t_offset"):
                np.testing.assert_array_equal(grown[name], whole[name])
    assert (tmp_path / "333.h5").read_bytes() == (tmp_path / "10000.h5").read_bytes()


@pytest.mark.parametrize(("start_us", "most_us"), [(-500, 30), (2**40, 30), (5, 2_000_000), (2**32 - 9000, 30)])
def test_times_anywhere_come_back(start_us, most_us, tmp_path):
    events = stream(5000, start_us, most_us)
    write(tmp_path / "e.h5", events, 700)
    assert_equal(read_events(tmp_path / "e.h5"), events)
    hdf5.write(tmp_path / "whole.h5", events, SIZE)
    with h5py.File(tmp_path / "e.h5") as grown, h5py.File(tmp_path / "whole.h5") as whole:
        assert grown["events/t"].dtype == whole["events/t"].dtype
        assert ("ms_to_idx" in grown) == ("ms_to_idx" in whole) == (most_us < 10**6)
        for name in ("events/t", "ms_to_idx", "t_offset") if "ms_to_idx" in whole else ():
            np.testing.assert_array_equal(grown[name], whole[name])


def test_settings_are_kept_where_there_is_a_place(tmp_path):
    for name in ("e.h5", "e.npz"):
        write(tmp_path / name, stream(3000), 100)
        assert_equal(read_events(tmp_path / name), stream(3000))
        assert read_settings(tmp_path / name) == {"seed": 1}
    write(tmp_path / "e.csv", stream(30), 100)
    assert read_events(tmp_path / "e.csv").count == 30
    with pytest.raises(DataError, match=r"e\.csv.*HDF5 and \.npz"):
        read_settings(tmp_path / "e.csv")


def test_files_without_settings_are_named(tmp_path):
    for name, codec in (("e.h5", hdf5), ("e.npz", npz)):
        codec.write(tmp_path / name, stream(10), SIZE)
        with pytest.raises(DataError, match=f"{name}.*keeps no settings"):
            read_settings(tmp_path / name)
    with writing(tmp_path / "bad.h5", SIZE, settings=json.dumps([1])):
        pass
    with pytest.raises(DataError, match="settings are damaged"):
        read_settings(tmp_path / "bad.h5")
    (tmp_path / "no.npz").write_bytes(b"PK nothing")
    with pytest.raises(DataError, match=r"no\.npz"):
        read_settings(tmp_path / "no.npz")


@pytest.mark.parametrize("suffix", [".h5", ".npz", ".csv"])
def test_an_error_leaves_nothing(suffix, tmp_path):
    with pytest.raises(RuntimeError, match="stop"), writing(tmp_path / "new" / f"e{suffix}", SIZE) as push:
        push(stream(5000))
        raise RuntimeError("stop")
    assert list(tmp_path.iterdir()) == []


class Full:
    """A disk with room for so many bytes."""

    def __init__(self, file, room: int):
        self._file, self._room = file, room

    def write(self, data) -> int:
        if self._file.tell() + len(data) > self._room:
            raise OSError(errno.ENOSPC, "No space left on device")
        return self._file.write(data)

    def __getattr__(self, name):
        return getattr(self._file, name)


@pytest.mark.parametrize("room", [0, 3000, 20_000, 60_000])
def test_a_full_disk_is_one_clear_line_and_leaves_nothing(room, tmp_path, monkeypatch):
    staged = atomic.staged

    class Staged:
        def __init__(self, path):
            self._staged = staged(path)

        def __enter__(self):
            return Full(self._staged.__enter__(), room)

        def __exit__(self, *error):
            return self._staged.__exit__(*error)

    monkeypatch.setattr(atomic, "staged", Staged)
    with pytest.raises(StorageError, match=r"cannot write .*e\.h5: no space left"):
        write(tmp_path / "e.h5", stream(20_000), 500)
    assert list(tmp_path.iterdir()) == []
    with h5py.File(tmp_path / "alive.h5", "w") as file:
        file["x"] = 1


def test_a_disk_that_is_full_for_sqlite_is_one_clear_line_and_leaves_nothing(tmp_path, monkeypatch):
    pytest.importorskip("rosbags")
    connect = sqlite3.connect

    def small(*arguments, **options):
        made = connect(*arguments, **options)
        made.execute("PRAGMA max_page_count = 20")
        return made

    monkeypatch.setattr(sqlite3, "connect", small)
    with pytest.raises(StorageError, match=r"cannot write .*e\.db3: no space left on the disk$"):
        write(tmp_path / "new" / "e.db3", stream(20_000), 5000)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("suffix", [".bag", ".db3"])
def test_what_a_killed_writer_of_a_bag_left_goes_when_the_bag_is_written_again(suffix, tmp_path):
    pytest.importorskip("rosbags")
    path, there = tmp_path / f"e{suffix}", tmp_path / "there"
    with writing(path, SIZE):
        (folder,) = (one for one in tmp_path.iterdir() if one.is_dir())
        atomic.write_bytes(path, b"of another writer")
        assert folder.exists()
        shutil.copytree(folder, there)
    there.rename(folder)  # nobody holds it
    write(path, stream(30), 100)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("name", ["a#b", "a?b", "a%20b"])
def test_bags_may_have_names_that_mean_something_in_an_address(name, tmp_path):
    pytest.importorskip("rosbags")
    (tmp_path / name).mkdir()
    path = tmp_path / name / f"{name}.db3"
    write(path, stream(30), 100)
    assert list(path.parent.iterdir()) == [path]
    assert read_whole(path)[0].count == 30


def test_the_bytes_of_aedat4_depend_on_the_events_alone(tmp_path):
    events, written = stream(25_000), []
    for value in (0, 255):  # what memory held before must not get into the file
        left_over = [np.full(bytes_, value, np.uint8) for bytes_ in range(48, 480, 48) for _ in range(20)]
        del left_over
        with writing(tmp_path / "a.aedat4", (346, 260)) as push:
            push(events)
        written.append((tmp_path / "a.aedat4").read_bytes())
    assert written[0] == written[1]


def test_unknown_suffixes_are_refused(tmp_path):
    with pytest.raises(DataError, match=r"e\.mp4"), writing(tmp_path / "e.mp4", SIZE):
        pass
