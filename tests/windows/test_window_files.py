"""The file of windows as its page says that it can be read, and crops as large as the sensor."""

import pickle
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

import evslip
from command_line import evslip as run
from evslip.data import record_file
from evslip.utils.errors import ConfigError, DataError, StorageError
from evslip.windows.cutting import crop, windows_of
from evslip.windows.settings import WindowSettings
from evslip.windows.window_events import WindowEvents, pack
from evslip.windows.window_set import Windows, require_replaceable
from slip_records import SIZE, slip_records, slip_windows

PAGE = Path(__file__).parents[2] / "docs/reference/windows.md"


@pytest.fixture(scope="module")
def path(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("windows") / "train.h5"
    slip_windows().save(path)
    return path


@pytest.fixture(scope="module")
def wide() -> Windows:
    return windows_of(slip_records(8), whole_sensor=True)


def by_h5py(path: Path, number: int) -> list[np.ndarray]:
    """A window's columns by the code of the page."""
    code = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)[-1]
    code = code.replace('"train.h5"', repr(str(path))).replace("][0] for", f"][{number}] for")
    names: dict[str, np.ndarray] = {}
    exec(code, names)
    return [names[name] for name in ("times_us", "x", "y", "on")]


def test_the_code_of_the_page_runs(path, monkeypatch):
    monkeypatch.chdir(path.parent)
    names: dict[str, object] = {}
    for code in re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL):
        exec(code, names)


def test_the_page_names_every_array_with_its_dtype(path, wide, tmp_path):
    rows = dict(re.findall(r"^\| ([a-z_, ]+) \| (.*?) \|", PAGE.read_text(), re.MULTILINE))
    said = {name: kind for names, kind in rows.items() for name in names.split(", ")}
    wide.save(tmp_path / "wide.h5")
    for file in (path, tmp_path / "wide.h5"):
        with h5py.File(file) as stored:
            assert set(stored) == said.keys() - {"data set"}
            for name, array in stored.items():
                assert (array.dtype.name if array.dtype.kind != "S" else "bytes") in said[name], name


@pytest.mark.parametrize("whole_sensor", [False, True])
def test_a_file_is_read_alike_by_h5py_alone(path, wide, tmp_path, whole_sensor):
    if whole_sensor:
        path = tmp_path / "wide.h5"
        wide.save(path)
    windows = evslip.open_windows(path)
    for i in range(0, len(windows), 5):
        for mine, theirs in zip(windows[i].columns, by_h5py(path, i), strict=True):
            np.testing.assert_array_equal(mine, theirs)


def test_a_crop_may_be_the_sensor(wide, tmp_path):
    assert (wide.settings.width, wide.settings.height) == wide.settings.sensor == SIZE
    wide.save(tmp_path / "wide.h5")
    back = evslip.open_windows(tmp_path / "wide.h5")
    records = {record.name: record for record in slip_records(8)}
    most = 0
    for i in range(len(back)):
        start = int(back.start_us[i])
        expected = WindowEvents.of(records[back.name[i]].events.between(start, start + 160_000), start)
        assert back[i] == WindowEvents(*expected.columns)
        most = max(most, int(back[i].x.max()))
    assert most > 300 and back.packed.dtype == np.uint16


def test_whole_sensor_on_the_command_line(tmp_path):
    for number, record in enumerate(slip_records(4)):
        record_file.write(tmp_path / "set" / f"{number}.h5", replace(record, kind="recording", split=None))
    assert run("windows", tmp_path / "set", tmp_path / "w.h5", "--whole-sensor").returncode == 0
    settings = evslip.open_windows(tmp_path / "w.h5").settings
    assert settings == settings.of_whole_sensor() and settings.sensor == SIZE


@pytest.mark.parametrize(("width", "height"), [(0, 5), (5, 0), (4096, 4096)])
def test_crops_of_nothing_and_of_too_much_are_refused(width, height):
    with pytest.raises(ConfigError, match=r"at most 2\.1 million pixels"):
        WindowSettings(left=0, top=0, width=width, height=height, sensor_width=4096, sensor_height=4096)


def test_slices_and_masks_pick_windows(path):
    windows = evslip.open_windows(path)
    assert len(windows[3:7]) == 4 and windows[3:7][0] == windows[3] == windows[np.int64(3) - len(windows)]
    slips = windows[windows.label == 1]
    assert len(slips) == (windows.label == 1).sum() and (slips.label == 1).all()
    assert [len(events) for events in windows] == windows.events.tolist()


def test_another_process_maps_the_file_anew(path, tmp_path):
    copy = tmp_path / "copy.h5"
    copy.write_bytes(path.read_bytes())
    windows = evslip.open_windows(copy)
    sent = pickle.dumps(windows)
    assert len(sent) < windows.packed.nbytes / 2
    back = pickle.loads(sent)
    assert isinstance(back.packed, np.memmap) and back[5] == windows[5]
    in_memory = pickle.loads(pickle.dumps(replace(windows, packed=np.array(windows.packed))))
    assert in_memory[5] == windows[5]
    copy.unlink()
    with pytest.raises(StorageError, match=r"copy\.h5"):
        pickle.loads(sent)


def test_pixels_beyond_the_crop_are_damage(path, tmp_path):
    """A file whose checksums agree: nothing may be written beside a network's grid."""
    windows = evslip.open_windows(path)
    with h5py.File(path) as file:
        entries = np.asarray(file["packed"][windows.first[0] : windows.last[0]])
    assert np.array_equal(entries, pack(windows[0]))
    narrow = replace(windows, settings=replace(windows.settings, width=20, left=100))
    with pytest.raises(DataError, match=r"window 0 .* damaged"):
        narrow[0]


def test_pairs_are_those_of_tonic(path):
    windows = evslip.open_windows(path)
    pairs = windows.labelled_events(transform=len, target_transform=lambda label: pairs.classes[label])
    assert [pairs[i] for i in range(len(pairs))] == [
        (len(windows[i]), ("hold", "slip")[windows.label[i]]) for i in range(len(windows))
    ]
    events, label = windows.labelled_events()[2]
    assert events.dtype == np.dtype([("x", "<i2"), ("y", "<i2"), ("t", "<i8"), ("p", "?")])
    np.testing.assert_array_equal(events["t"], windows[2].t_us)
    assert (type(label), len(windows.labelled_events()[1:4])) == (int, 3)


def test_numpy_and_tonic_access_need_no_torch(path):
    code = (
        "import sys, evslip; w = evslip.open_windows(sys.argv[1]); w[0], w.labelled_events()[0]; "
        "sys.exit('torch' in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code, str(path)], check=True)


def test_a_whole_crop_is_the_stream():
    settings = WindowSettings().of_whole_sensor()
    events = slip_records(1)[0].events
    assert crop(events, settings) == events


def test_what_is_no_file_of_windows_is_not_replaced(path, tmp_path):
    for name, content in {"notes.txt": b"mine", "config.toml": b"a = 1\n", "clip.npz": b"PK\x03\x04"}.items():
        (tmp_path / name).write_bytes(content)
        with pytest.raises(DataError, match="is there already, and no file of windows"):
            require_replaceable(tmp_path / name)
    (tmp_path / "empty.h5").touch()
    for other in (tmp_path / "empty.h5", tmp_path / "new.h5", path):
        require_replaceable(other)
