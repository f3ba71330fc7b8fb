"""Windows of several data sets in one file."""

import os
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from evslip.data.record_file import write
from evslip.data.recordings import open_samples
from evslip.data.samples import Samples
from evslip.utils.errors import ConfigError, DataError
from evslip.windows.cutting import windows_of
from evslip.windows.mixture import Mixture, plain_name, set_names
from evslip.windows.settings import WindowSettings
from evslip.windows.window_set import open_windows
from slip_records import slip_records


@pytest.fixture(scope="module")
def sets(tmp_path_factory: pytest.TempPathFactory) -> list[Samples]:
    """Two folders of records of the same names, with other events."""
    home = tmp_path_factory.mktemp("sets")
    for folder in ("near", "far"):
        (home / folder).mkdir()
        for number, record in enumerate(slip_records(4)):
            events = record.events if folder == "near" else record.events.replace(p=~record.events.p)
            write(home / folder / f"{number}.h5", replace(record, kind="recording", split=None, events=events))
    return [open_samples(home / folder) for folder in ("near", "far")]


def test_windows_chosen_before_the_events_are_read_are_those_chosen_after(sets: list[Samples]):
    for records in (sets[0], Mixture(sets)):
        before, after = windows_of(records), windows_of(iter(records))
        assert 0 < len(before) < len(windows_of(records, WindowSettings(balance=False)))
        assert (before.name == after.name).all() and (before.start_us == after.start_us).all()
        assert (before.checksum == after.checksum).all() and before.dropped == after.dropped


def test_trajectories_of_different_sets_stay_apart(sets: list[Samples], tmp_path: Path):
    alone, both = windows_of(sets[0]), windows_of(Mixture(sets))
    assert len(np.unique(both.name)) == 2 * len(np.unique(alone.name))
    assert {name.partition(":")[0] for name in both.name} == {"near", "far"}
    assert {plain_name(name) for name in both.name} == set(alone.name)
    both.save(tmp_path / "both.h5")
    parts = open_windows(tmp_path / "both.h5").split_by_trajectory(0.5)
    assert not set(parts[0].name) & set(parts[1].name)


def test_a_copy_of_a_set_is_refused(sets: list[Samples], tmp_path: Path):
    shutil.copytree(sets[0].root, tmp_path / "copy")
    with pytest.raises(DataError, match=r"copy:train/0000000: is near:train/0000000 once more"):
        windows_of(Mixture([sets[0], open_samples(tmp_path / "copy")]))


def test_one_set_keeps_its_names_and_bytes(sets: list[Samples], tmp_path: Path):
    windows_of(sets[0]).save(tmp_path / "plain.h5")
    windows_of(Mixture(sets[:1])).save(tmp_path / "mixed.h5")
    assert (tmp_path / "plain.h5").read_bytes() == (tmp_path / "mixed.h5").read_bytes()


def test_names_of_sets_are_unique(tmp_path: Path):
    roots = [tmp_path / path for path in ("a/data", "b/data", "c/data-2")]
    assert set_names(roots) == ["data", "data-2", "data-2-2"]
    with pytest.raises(ConfigError, match="given twice"):
        set_names([tmp_path / "data", tmp_path / "a/../data"])


def test_sensors_must_agree(sets: list[Samples]):
    class Small(list):
        root = Path("small")
        without_events = list.__iter__

    other = Small(replace(record, size=(320, 240)) for record in sets[0])
    with pytest.raises(DataError, match="320x240"):
        windows_of(Mixture([sets[0], other]))  # pyright: ignore[reportArgumentType]


def test_a_folder_whose_name_is_not_utf_8_gives_names_that_can_be_stored(sets: list[Samples], tmp_path: Path):
    odd = tmp_path / os.fsdecode(b"far\xff")
    shutil.copytree(sets[1].root, odd)
    cut = windows_of(Mixture([sets[0], open_samples(odd)]))
    cut.save(tmp_path / "both.h5")
    names = open_windows(tmp_path / "both.h5").name
    assert {name.partition(":")[0] for name in names} == {"near", "far\\xff"}
