"""Records of two cameras, and those who read them."""

from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from evslip.codecs import open_events
from evslip.data import record_file
from evslip.data.record import Record
from evslip.data.recordings import Recordings
from evslip.utils.errors import ConfigError, DataError
from evslip.windows.cutting import windows_of
from evslip.windows.mixture import Mixture
from evslip.windows.settings import WindowSettings
from sample_records import assert_equal, simulated
from two_cameras import seen_by_two


@pytest.fixture
def path(tmp_path: Path) -> Path:
    record_file.write(tmp_path / "two.h5", seen_by_two())
    return tmp_path / "two.h5"


def test_a_record_comes_back_as_each_camera_saw_it(path: Path):
    whole = seen_by_two()
    for camera, stream in whole.streams.items():
        found = record_file.read(path, camera=camera)
        assert_equal(replace(found, streams={}), whole.seen_by(camera))
        assert found.camera == camera and found.size == stream.size and found.stats == stream.stats
        assert_equal(found.events, stream.events)
        assert found.trajectory is not None
        assert (found.trajectory.camera_displacement is None) == (camera == "left")
        head, parts = record_file.open_recording(path, camera)
        assert head.size == stream.size and sum(part.count for part in parts) == stream.events.count
    assert record_file.encode(whole) == record_file.encode(seen_by_two())
    assert whole.count == 250


def test_what_one_camera_saw_is_a_record_of_one_camera(tmp_path: Path):
    alone = seen_by_two().seen_by("right")
    record_file.write(tmp_path / "right.h5", alone)
    assert_equal(record_file.read(tmp_path / "right.h5"), alone)
    with h5py.File(tmp_path / "right.h5") as file:
        assert file.attrs["version"] == 1 and "events" in file


def test_the_group_of_a_camera_has_the_layout_of_a_file_of_events(path: Path):
    with h5py.File(path) as file:
        assert file.attrs["version"] == 2 and not {"events", "ms_to_idx", "t_offset"} & set(file)
        for name, more in (("left", set()), ("right", {"camera_displacement"})):
            group = file[f"cameras/{name}"]
            assert set(group) == {"events", "ms_to_idx", "t_offset"} | more
            assert set(group["events"]) == {"x", "y", "t", "p", "body", "cause"}
            assert set(group.attrs) == {"width", "height", "stats"}


@pytest.mark.parametrize("reading", [record_file.read, record_file.read_recording, open_events])
def test_a_camera_has_to_be_named_where_its_events_are_read(path: Path, reading):
    with pytest.raises(
        DataError, match=r"two\.h5: holds the events of the cameras left, right; .* --camera left; evslip convert"
    ):
        reading(path)
    with pytest.raises(DataError, match=r"holds the events of the cameras left, right; .*, not 'up'$"):
        reading(path, camera="up")
    assert record_file.read(path, events=False).label == "slip"


def test_a_record_of_one_camera_has_no_names(tmp_path: Path):
    record_file.write(tmp_path / "one.h5", simulated())
    with pytest.raises(DataError, match=r"one\.h5: holds the events of one camera, which has no name; .* not 'left'"):
        record_file.read(tmp_path / "one.h5", camera="left")
    (tmp_path / "one.csv").write_text("t,x,y,p\n1,1,1,1\n")
    with pytest.raises(DataError, match=r"one\.csv: holds the events of one camera"):
        open_events(tmp_path / "one.csv", "left")
    with pytest.raises(ConfigError, match="one camera, which has no name"):
        simulated().seen_by("left")


def test_streams_that_are_not_those_of_the_parameters_are_refused():
    left, right = seen_by_two().streams.values()
    for streams, error in (
        ({"left": left}, "streams of the cameras left, and parameters of left, right"),
        ({"left": left, "right": left}, "right: size .* is not that of its camera"),
        ({"left": left, "right": right._replace(camera_displacement=np.ones((2, 7)))}, "right/camera_displacement"),
    ):
        with pytest.raises(DataError, match=error):
            record_file.encode(replace(seen_by_two(), streams=streams))


def held(record: Record) -> Record:
    """With a truth that holds for a second, or turns."""
    truth, steps = record.truth, 1001
    assert truth is not None and record.trajectory is not None
    degrees = np.linspace(0, 40.0 if record.onset_us is not None else 0.0, steps)
    half = np.radians(degrees) / 2
    t_us = np.arange(steps) * 1000
    rotation = np.stack([np.cos(half), 0 * half, np.sin(half), 0 * half], 1)
    changed = truth._replace(
        t_us=t_us, theta_deg=degrees, rotation=rotation, position_m=np.zeros((steps, 3)), held=np.ones(steps, bool),
        phase=np.zeros(steps, np.uint8),
    )  # fmt: skip
    columns = {
        name: np.resize(getattr(record.trajectory, name), (steps, *getattr(record.trajectory, name).shape[1:]))
        for name in ("gripper_pose", "object_pose", "joints", "pad_force_n", "floor_force_n")
    }
    moved = record.trajectory._replace(t_us=t_us, pad_friction=None, pad_utilisation=None, **columns)
    streams = {name: stream._replace(camera_displacement=None) for name, stream in record.streams.items()}
    return replace(record, truth=changed, trajectory=moved, streams=streams)


def test_windows_are_of_one_camera_or_of_several_with_one_sensor(tmp_path: Path):
    for index in range(2):
        record_file.write(tmp_path / f"{index}.h5", held(seen_by_two(index)))
    samples, settings = Recordings(tmp_path), WindowSettings(balance=False)
    with pytest.raises(DataError, match="--camera left"):
        samples.windows(settings)
    left, right = (windows_of(samples.seen_by(name), settings, True) for name in ("left", "right"))
    assert len(left) == len(right) > 0 and (left.settings.width, right.settings.width) == (40, 48)
    with pytest.raises(DataError, match="expected windows of one sensor"):
        windows_of(samples.seen_by("all"), settings, True)


def test_both_streams_of_a_sample_come_to_lie_on_one_side_of_a_split(tmp_path: Path):
    for index in range(4):
        record = held(seen_by_two(index))
        left = record.streams["left"]
        assert record.params is not None and record.trajectory is not None
        camera = record.params.camera.model_copy(update={"right": record.params.camera.left})
        params = record.params.model_copy(update={"camera": camera})
        both = {"left": left, "right": left._replace(events=left.events.select(np.arange(50)))}
        record = replace(record, params=params, trajectory=record.trajectory._replace(params=params), streams=both)
        record_file.write(tmp_path / f"{index}.h5", record)
    samples = Recordings(tmp_path)
    one = windows_of(samples.seen_by("left"), WindowSettings(balance=False), True)
    every = windows_of(Mixture([samples.seen_by("all")]), WindowSettings(balance=False), True)
    assert len(every) == 2 * len(one) and set(every.name) == set(one.name)
    first, second = every.split_by_trajectory(0.5)
    assert not set(first.name) & set(second.name)
    assert samples.status()["events"] == 4 * 150 and len(samples.seen_by("all")) == 8
