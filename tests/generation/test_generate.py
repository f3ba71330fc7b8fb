import hashlib
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import evslip
from evslip.config.loading import dump_config
from evslip.data import building
from evslip.generation import generate
from evslip.generation.generate import Job, make_sample
from evslip.generation.progress import Progress
from evslip.utils.errors import ConfigError

SMALL = {"camera.width": 64, "camera.height": 48, "render.max_motion_px": 2.0}
"""A camera that makes whole samples in a fraction of a second."""


def small_config(**overrides) -> evslip.Config:
    return evslip.load_config("demo", {**SMALL, **overrides})


def records(root: Path) -> dict[str, str]:
    """Path and hash of every record."""
    files = sorted((root / "samples").rglob("*"))
    return {str(f.relative_to(root)): hashlib.sha256(f.read_bytes()).hexdigest() for f in files if f.is_file()}


@pytest.fixture(scope="module")
def finished(tmp_path_factory) -> Path:
    root = tmp_path_factory.mktemp("data")
    evslip.generate(small_config(), root, 4, workers=1)
    return root


def test_records_do_not_depend_on_the_number_of_workers(finished, tmp_path):
    evslip.generate(small_config(), tmp_path, 4, workers=2)
    assert records(tmp_path) == records(finished)
    assert len(records(finished)) == 4


def test_generating_again_makes_nothing_and_changes_nothing(finished):
    before = records(finished)
    summary = evslip.generate(small_config(), finished, 4, workers=1)
    assert (len(summary.made), summary.skipped) == (0, 4)
    assert records(finished) == before


@pytest.mark.slow
def test_a_killed_generator_resumes_to_the_same_bytes(finished, tmp_path):
    script = f"import evslip; evslip.generate(evslip.load_config('demo', {SMALL!r}), {str(tmp_path)!r}, 4, workers=2)"
    process = subprocess.Popen([sys.executable, "-c", script], start_new_session=True)
    deadline = time.monotonic() + 120
    while not list(tmp_path.rglob("*.h5")) and time.monotonic() < deadline:
        time.sleep(0.01)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    evslip.generate(small_config(), tmp_path, 4, workers=2)
    assert records(tmp_path) == records(finished)
    assert evslip.open_dataset(tmp_path).verify() == []


def test_half_of_the_samples_slip_and_the_rest_hold(finished):
    onsets = [record.truth.onset_us for record in evslip.open_dataset(finished)]
    assert [onset is None for onset in onsets] == [True, False, True, False]


def test_the_object_fires_when_it_slips(finished):
    hold, slip = (evslip.open_dataset(finished)[i] for i in (0, 1))
    of_object = [np.count_nonzero(record.events.body == 2) for record in (hold, slip)]
    assert of_object[1] > 10 * of_object[0]


def test_a_failed_grasp_is_recorded_at_its_index_and_never_redrawn(tmp_path):
    config = small_config(**{"object.mass_kg": 0.2, "grip.force_n": 1.0})
    summary = evslip.generate(config, tmp_path, 1, workers=1)
    assert summary.made[0].entry["kind"] == "rejected"
    dataset = evslip.open_dataset(tmp_path)
    assert [entry["rejection"][0] for entry in dataset.rejections] == ["never_lifted"]
    assert evslip.generate(config, tmp_path, 1, workers=1).skipped == 1


def test_another_configuration_is_refused_with_the_difference(finished):
    with pytest.raises(ConfigError, match="force_n"):
        evslip.generate(small_config(**{"grip.force_n": 1.1}), finished, 4, workers=1)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"count": 0}, "count: 0"),
        ({"workers": 0}, "workers: 0"),
        ({"split": "validation"}, "split: 'validation'"),
        ({"runner_name": "cloud"}, "runner: 'cloud'"),
        ({"runner_name": "local:head"}, "runner: 'local:head'"),
        ({"part": (0, 2)}, "part: 0/2"),
        ({"part": (3, 2)}, "part: 3/2"),
        ({"limit_s": 0.0}, "limit_s: 0"),
    ],
)
def test_wrong_arguments_leave_no_folder_behind(arguments, words, tmp_path):
    with pytest.raises(ConfigError, match=words):
        evslip.generate(small_config(), tmp_path / "new", **{"count": 1, "workers": 1, **arguments})
    assert not (tmp_path / "new").exists()


def test_an_unreachable_object_stops_the_run_and_names_sample_and_key(tmp_path):
    with pytest.raises(ConfigError, match=r"sample train/0: object\.x_m 0\.9.*cannot reach"):
        evslip.generate(small_config(**{"object.x_m": 0.9}), tmp_path / "new", 1, workers=1)
    assert not (tmp_path / "new").exists()


def test_a_lens_that_folds_the_image_stops_the_run_and_names_sample_and_key(tmp_path):
    with pytest.raises(ConfigError, match=r"sample train/0: camera\.k1 -0\.9.*folds the image"):
        evslip.generate(small_config(**{"camera.k1": -0.9}), tmp_path / "new", 1, workers=1)
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize(
    ("key", "values", "wanted"),
    [("object.x_m", [0.9, 0.461], "unreachable"), ("camera.k1", [-0.9, 0.0], "camera")],
    ids=["an object out of reach", "a lens that folds the image"],
)
def test_what_cannot_be_at_some_index_is_a_rejection_there(key, values, wanted, tmp_path):
    config = small_config(**{"sampling": "grid", "object.mass_kg": 0.012, key: values, "test_share": 0})
    summary = evslip.generate(config, tmp_path, 2, workers=1)
    assert [made.entry["kind"] for made in summary.made] == ["rejected", "simulated"]
    (rejection,) = evslip.open_dataset(tmp_path).rejections
    kind, reason = rejection["rejection"]
    assert kind == wanted
    assert f"{key} {values[0]}" in reason


def test_parts_make_up_the_whole_and_leave_each_others_samples_alone(finished, tmp_path):
    made = [evslip.generate(small_config(), tmp_path, 4, part=(i, 3), workers=1).made for i in (3, 1, 2)]
    assert [[m.entry["index"] for m in part] for part in made] == [[2, 3], [0], [1]]
    assert records(tmp_path) == records(finished)
    assert evslip.open_dataset(tmp_path).status()["missing"] == 0


def test_progress_begins_with_what_is_there(finished):
    told = []

    class Listener(Progress):
        def begin(self, count, skipped):
            told.append((count, skipped))

    evslip.generate(small_config(), finished, 4, part=(2, 2), workers=1, progress=Listener())
    assert told == [(2, 2)]


def test_other_versions_on_a_node_are_refused(tmp_path):
    building.create(tmp_path, toml := dump_config(small_config()))
    with pytest.raises(ConfigError, match=r"sample train/0: mujoco .*but 1\.0 where the run was started"):
        make_sample(Job(str(tmp_path), toml, "train", 0, '{"mujoco": "1.0"}'))


def test_a_data_set_of_another_version_is_not_gone_on_with(finished, monkeypatch):
    """It opens and verifies; nothing new is made, since the frames of versions differ."""
    before = records(finished)
    monkeypatch.setattr("evslip.generation.generate.__version__", "9.9")
    with pytest.raises(ConfigError, match=r"was made by evslip .* not those of 9\.9; expected a new folder"):
        evslip.generate(small_config(), finished, 5, workers=1)
    assert records(finished) == before
    assert evslip.open_dataset(finished).verify() == []
    assert len(evslip.generate(small_config(), finished, 4, workers=1).made) == 0


def test_a_configuration_that_failed_can_be_mended_in_its_folder(tmp_path):
    with pytest.raises(ConfigError, match="cannot reach"):
        evslip.generate(small_config(**{"object.x_m": 0.9}), tmp_path, 1, workers=1)
    assert len(evslip.generate(small_config(), tmp_path, 1, workers=1).made) == 1


def other_versions(monkeypatch, **changed: str) -> None:
    here = generate._versions() | changed
    monkeypatch.setattr(generate, "_versions", lambda: here)


@pytest.mark.parametrize("split", ["train", "test"])
def test_a_part_of_other_versions_is_refused_though_it_finds_nothing_of_its_own(tmp_path, monkeypatch, split):
    config = small_config(test_share=0.5)
    evslip.generate(config, tmp_path, 2, part=(1, 2), workers=1)
    before = records(tmp_path)
    other_versions(monkeypatch, numpy="9.9.9")
    part = (2, 2) if split == "train" else (1, 1)
    path = tmp_path / "samples/train/000/0000000.h5"
    with pytest.raises(ConfigError, match=rf"^numpy 9\.9\.9 here, \d.* in {path}; expected the same"):
        evslip.generate(config, tmp_path, 2, split=split, part=part, workers=1)
    assert records(tmp_path) == before
    assert not (tmp_path / "plan-test.json").exists()


def test_a_run_of_other_versions_does_not_resume(finished, monkeypatch):
    other_versions(monkeypatch, hdf5="1.0")
    with pytest.raises(ConfigError, match=r"^hdf5 1\.0 here, "):
        evslip.generate(small_config(), finished, 5, workers=1)
    assert len(evslip.generate(small_config(), finished, 4, workers=1).made) == 0


def test_a_damaged_record_tells_no_versions(finished, tmp_path):
    root = tmp_path / "copy"
    shutil.copytree(finished, root)
    paths = sorted((root / "samples").rglob("*.h5"))
    paths[0].write_bytes(paths[0].read_bytes()[:-1])
    assert len(evslip.generate(small_config(), root, 4, part=(1, 4), workers=1).made) == 1
    assert records(root) == records(finished)
