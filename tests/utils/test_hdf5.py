"""HDF5 files from outside: what leads out of the file is refused by every reader, before anything is read."""

import resource
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from evslip.codecs import open_events, read_events
from evslip.codecs.facts import examine
from evslip.codecs.settings import read_settings
from evslip.data import record_file
from evslip.exchange.format_to_format import convert_format
from evslip.utils import hdf5
from evslip.utils.errors import DataError, StorageError
from evslip.windows.window_set import open_windows
from sample_records import simulated

SECRET = b"root:x:0:0:secret"


def linked(file: h5py.File, name: str, secret: Path) -> None:
    file[name] = h5py.ExternalLink(str(secret), "/x")


def by_way_of(file: h5py.File, name: str, secret: Path) -> None:
    file["way"] = h5py.ExternalLink(str(secret), "/")
    file[name] = h5py.SoftLink("/way/x")


def virtual(file: h5py.File, name: str, secret: Path) -> None:
    layout = h5py.VirtualLayout((len(SECRET),), np.uint8)
    layout[:] = h5py.VirtualSource(secret, "x", (len(SECRET),))
    file.create_virtual_dataset(name, layout)


def raw(file: h5py.File, name: str, secret: Path) -> None:
    file.create_dataset(name, (len(SECRET),), np.uint8, external=[(str(secret), 0, len(SECRET))])


WAYS = (linked, by_way_of, virtual, raw)
READERS = (
    read_events,
    lambda path: list(open_events(path).parts),
    record_file.read,
    record_file.read_recording,
    examine,
    read_settings,
    open_windows,
    lambda path: convert_format(path, path.with_name("out.csv")),
)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("reader", range(len(READERS)))
def test_no_reader_follows_what_leads_out_of_a_file(
    tmp_path: Path, way: Callable[..., None], reader: int, monkeypatch: pytest.MonkeyPatch
):
    secret = tmp_path / "secret.h5"
    with h5py.File(secret, "w") as file:
        file["x"] = np.frombuffer(SECRET, np.uint8)
    record_file.write(tmp_path / "a.h5", simulated())
    with h5py.File(tmp_path / "a.h5", "a") as file:
        del file["events/x"]
        way(file, "events/x", secret)
    monkeypatch.setattr(h5py.Dataset, "__getitem__", lambda *_: pytest.fail("data were read"))
    reading: Any = READERS[reader]
    with pytest.raises(DataError, match=r"a\.h5: /(events/x|way) is .*expected a file that holds all of its data"):
        reading(tmp_path / "a.h5")
    assert not (tmp_path / "out.csv").exists()


def test_links_inside_a_file_are_followed(tmp_path: Path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["x"] = np.arange(3)
        file["group/hard"], file["group/up"] = file["x"], file["/"]
        file["soft"], file["nowhere"], file["itself"] = map(h5py.SoftLink, ("/x", "/y", "/itself"))
    with hdf5.opened(tmp_path / "a.h5") as file:
        assert hdf5.get(file, "soft", "i", (3,)).tolist() == hdf5.get(file, "group/hard", "i", (3,)).tolist()
        with pytest.raises(DataError, match="nowhere is missing"):
            hdf5.get(file, "nowhere", "i", (3,))
    with pytest.raises(DataError, match="too many links"), hdf5.opened(tmp_path / "a.h5") as file:
        hdf5.get(file, "itself", "i", (3,))


def filled(file: h5py.File) -> None:
    hdf5.put(file, "x", np.arange(50_000))
    packed = file.create_dataset("packed", (100_000, 3), np.uint8)
    for first in range(0, 100_000, 10_000):
        packed[first : first + 10_000] = np.full((10_000, 3), first // 10_000)  # one number is written row by row


def test_a_file_that_never_was_in_memory_is_the_same_every_time(tmp_path: Path) -> None:
    for name in ("a.h5", "b.h5"):
        hdf5.write(tmp_path / name, filled)
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()
    with hdf5.opened(tmp_path / "a.h5") as file:
        np.testing.assert_array_equal(hdf5.get(file, "x", "i", (None,)), np.arange(50_000))
        np.testing.assert_array_equal(
            hdf5.mapped(file, "packed", np.dtype(np.uint8), (None, 3))[::10_000, 1], range(10)
        )


@pytest.mark.parametrize("room", [0, 100, 3000, 100_000])
def test_a_disk_that_refuses_is_one_clear_line_and_leaves_nothing(room: int, tmp_path: Path) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    before = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, hard))
        with pytest.raises(StorageError, match=r"cannot write .*a\.h5: "):
            hdf5.write(tmp_path / "a.h5", filled)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, before)
    assert list(tmp_path.iterdir()) == []
    hdf5.write(tmp_path / "a.h5", filled)  # HDF5 is well
