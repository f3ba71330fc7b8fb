"""docs/reference/record.md against the files that evslip writes."""

import re
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from evslip.data import record_file
from evslip.data.footage import Footage
from evslip.data.intervals import Interval
from evslip.data.record import Poses, Record
from sample_records import random_events, simulated

PAGE = Path(__file__).resolve().parents[2] / "docs" / "reference" / "record.md"


def documented() -> tuple[dict[str, tuple[str, str]], set[str]]:
    """Type and shape of each dataset on the page, and the file's attributes."""
    datasets, attributes = {}, set()
    for line in PAGE.read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if len(cells) == 4 and re.fullmatch(r"u?int\d+|float\d+", cells[1]):
            for name in cells[0].split(", "):
                datasets[name] = (cells[1], cells[2])
        elif len(cells) == 4 and cells[1].split(", ")[0] in ("str", "int"):
            attributes |= set(cells[0].split(", "))
    return datasets, attributes


def recording() -> Record:
    n = 4
    poses = Poses(np.arange(n) * 1000, *(np.ones((n, 7), np.float32) for _ in range(2)))
    truth = simulated(steps=n).truth
    assert truth is not None
    return Record(
        kind="recording",
        name="a",
        size=(40, 30),
        events=random_events(np.random.default_rng(0), 20, labelled=False),
        intervals=(Interval(0, 5, "slip"),),
        footage=Footage(np.arange(2), np.zeros((2, 30, 40), np.uint8)),
        poses=poses,
        truth=truth._replace(phase=None, episodes=()),
        notes={"mount": "side"},
    )


def trembling() -> Record:
    sample = simulated()
    assert sample.trajectory is not None
    moved = np.ones((len(sample.trajectory.t_us), 7), np.float32)
    motion = sample.trajectory._replace(object_displacement=moved, camera_displacement=moved)
    return replace(sample, trajectory=motion._replace(target_force_n=moved[:, 0]))


def contents(path: Path) -> tuple[dict[str, h5py.Dataset], set[str]]:
    found: dict[str, h5py.Dataset] = {}
    file = h5py.File(path)
    file.visititems(lambda name, item: found.update({name: item}) if isinstance(item, h5py.Dataset) else None)
    return found, set(file.attrs)


@pytest.mark.parametrize("sample", [simulated(), trembling(), recording()], ids=["simulated", "trembling", "recording"])
def test_the_page_names_what_is_written(tmp_path: Path, sample: Record):
    datasets, attributes = documented()
    record_file.write(tmp_path / "a.h5", sample)
    found, attrs = contents(tmp_path / "a.h5")
    assert attrs <= attributes
    assert {"format", "version", "kind", "name", "width", "height"} <= attrs
    for name, dataset in found.items():
        kind, shape = datasets[name]
        if dataset.dtype != np.float64 or kind.startswith("float64"):  # the samples of the tests hold doubles
            assert dataset.dtype == np.dtype(kind), name
        sizes = [part.strip() for part in shape.strip("()").split(",") if part.strip()]
        assert len(sizes) == dataset.ndim, name
        for size, said in zip(dataset.shape, sizes, strict=True):
            assert not said.isdecimal() or int(said) == size, name
        if dataset.size and dataset.ndim:
            assert (dataset.shuffle, dataset.compression, dataset.fletcher32) == (True, "gzip", True), name


def test_the_page_names_nothing_else(tmp_path: Path):
    datasets, _ = documented()
    written = set()
    for i, sample in enumerate((trembling(), recording())):
        record_file.write(tmp_path / f"{i}.h5", sample)
        written |= contents(tmp_path / f"{i}.h5")[0].keys()
    assert written == datasets.keys()
