"""Recordings of real cameras and samples of other simulators, as records."""

import csv
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from PIL import Image

from evslip.codecs import write_events
from evslip.data import record_file
from evslip.data.footage import Footage
from evslip.data.intervals import Interval, read_intervals
from evslip.data.record import Poses, Record
from evslip.data.recordings import Recordings, open_samples
from evslip.events.stream import Events
from evslip.exchange import vt_snn
from evslip.exchange.importing.pose_files import even, read_poses, truth_of
from evslip.exchange.importing.recordings import import_recording
from evslip.exchange.importing.settings import Importing
from evslip.exchange.vt_snn import export_windows, import_vt_snn, is_vt_snn
from evslip.utils.errors import ConfigError, DataError, StorageError
from evslip.view.report.report import write_report
from evslip.windows.cutting import windows_of
from evslip.windows.label import Label
from evslip.windows.window_set import WindowSettings
from sample_records import assert_equal, random_events, simulated
from shared_data import shared
from slip_records import slip_windows

SIZE = (346, 260)


def long_events(seconds: float = 2.0, start_us: int = 0, count: int = 4000, seed: int = 0) -> Events:
    rng = np.random.default_rng(seed)
    times = start_us + np.sort(rng.integers(0, round(seconds * 1e6), count))
    times[0] = start_us
    return random_events(rng, count, SIZE, labelled=False).replace(t_us=times)


@pytest.fixture
def labels(tmp_path: Path) -> Path:
    path = tmp_path / "labels.csv"
    path.write_text("start_s,end_s,label\n# seen in the frames\n0.1,0.8,hold\n\n1.0, 1.5, SLIP\n1.5,5,hold\n")
    return path


def test_labels_are_read_in_order(labels: Path):
    assert read_intervals(labels) == (
        Interval(100_000, 800_000, "hold"),
        Interval(1_000_000, 1_500_000, "slip"),
        Interval(1_500_000, 5_000_000, "hold"),
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("0,1,slip\n0.5,2,hold\n", "hold from 0.5 to 2 s overlaps slip from 0 to 1 s"),
        ("0,1,fell\n", "line 1 is '0,1,fell', expected start_s,end_s,label"),
        ("start_s,end_s,label\n1,0.5,slip\n", "line 2"),
        ("-1,0.5,slip\n", "line 1"),
        ("nan,0.5,slip\n", "line 1"),
        ("0,1\n", "line 1"),
        ("0,1,slip,more\n", "line 1"),
    ],
)
def test_labels_that_cannot_be_are_refused(tmp_path: Path, text: str, message: str):
    (tmp_path / "l.csv").write_text(text)
    with pytest.raises(DataError, match=message) as caught:
        read_intervals(tmp_path / "l.csv")
    assert str(caught.value).startswith(str(tmp_path / "l.csv"))


def test_a_recording_becomes_a_record_like_others(tmp_path: Path, labels: Path):
    events = long_events(start_us=10**15)
    write_events(tmp_path / "real.aedat4", events, SIZE)
    how = Importing(labels=labels, crop=(6, 0, 340, 260), rotate=90, flip="y", sensor="DAVIS346", mount="side")
    made = import_recording(tmp_path / "real.aedat4", tmp_path / "out" / "real.h5", how)
    kept = events.x >= 6
    # Clockwise: the left column becomes the top row; then mirrored top to bottom.
    x, y = 259 - events.y[kept], 339 - (events.x[kept] - 6)
    turned = Events(events.t_us[kept] - 10**15, x.astype(np.uint16), y.astype(np.uint16), events.p[kept])
    assert_equal(made.events, turned)
    assert (made.kind, made.name, made.size) == ("recording", "real", (260, 340))
    assert made.intervals[-1].end_us == events.t_us[-1] - 10**15 + 1  # no label behind the last event
    assert made.notes == {
        "file": "real.aedat4",
        "first_event_us": str(10**15),
        "sensor": "DAVIS346",
        "mount": "side",
    }
    assert_equal(record_file.read(tmp_path / "out" / "real.h5"), made)
    again = import_recording(tmp_path / "out" / "real.h5", tmp_path / "again.h5")
    assert_equal(again, made)


def test_frames_and_labels_are_kept_in_the_file(tmp_path: Path):
    rng = np.random.default_rng(0)
    for images in (rng.integers(0, 256, (3, 30, 40), np.uint8), rng.integers(0, 256, (3, 30, 40, 3), np.uint8)):
        sample = Record(
            kind="recording",
            name="a",
            size=(40, 30),
            events=random_events(rng, 50, labelled=False),
            intervals=(Interval(-5, 20, "slip"),),
            footage=Footage(np.array([-3, 0, 9]), images),
            notes={"mount": "side"},
        )
        record_file.write(tmp_path / "a.h5", sample)
        assert_equal(record_file.read(tmp_path / "a.h5"), sample)
        assert record_file.read(tmp_path / "a.h5", events=False).intervals == sample.intervals
    with pytest.raises(DataError, match="frames/images"):
        record_file.encode(
            Record(kind="recording", name="a", size=(41, 30), events=sample.events, footage=sample.footage)
        )


def test_windows_of_a_recording_lie_in_its_intervals(tmp_path: Path, labels: Path):
    write_events(tmp_path / "real.h5", long_events(), SIZE)
    made = import_recording(tmp_path / "real.h5", tmp_path / "record.h5", Importing(labels=labels))
    windows = windows_of([made], WindowSettings(hop_s=0.1, balance=False))
    expected = [(100_000 + 100_000 * k, Label.HOLD) for k in range(6)]
    expected += [(1_000_000 + 100_000 * k, Label.SLIP) for k in range(4)] + [
        (1_500_000 + 100_000 * k, Label.HOLD) for k in range(4)
    ]
    assert list(zip(windows.start_us.tolist(), windows.label.tolist(), strict=True)) == expected
    # The object moved shortly before the first windows of the last interval, and within the slip.
    assert np.flatnonzero(windows.recent).tolist() == [7, 8, 9, 10, 11]
    assert np.isnan(windows.rotation_deg).all()
    assert all((windows[i].t_us <= 160_000).all() for i in range(len(windows)))


def test_a_folder_of_recordings_is_read_as_a_data_set_is(tmp_path: Path, labels: Path):
    write_events(tmp_path / "real.npz", long_events(), SIZE)
    folder = tmp_path / "records"
    import_recording(tmp_path / "real.npz", folder / "labelled.h5", Importing(labels=labels))
    import_recording(tmp_path / "real.npz", folder / "bare.h5")
    samples = open_samples(folder)
    assert isinstance(samples, Recordings)
    assert samples.labels() == ["unlabelled", "slip"]
    assert samples.status()["events"] == 8000
    assert len(samples.windows(WindowSettings(balance=False))) == 4 + 3 + 3
    assert open_samples(folder / "labelled.h5").labels() == ["slip"]
    page = write_report(folder / "report.html", samples).read_text()
    assert "without labels" in page
    assert "Event-camera recordings" in page
    write_events(tmp_path / "plain.h5", long_events())
    with pytest.raises(DataError, match="no record of evslip"):
        open_samples(tmp_path / "plain.h5")


def test_labels_beyond_the_recording_are_refused(tmp_path: Path, labels: Path):
    write_events(tmp_path / "short.npz", long_events(0.9), SIZE)
    with pytest.raises(DataError, match=r"begins at 1\.5 s, but the recording lasts 0\.9"):
        import_recording(tmp_path / "short.npz", tmp_path / "out.h5", Importing(labels=labels))
    assert not (tmp_path / "out.h5").exists()


def test_labels_of_a_time_without_events_in_the_crop_are_kept_or_refused(tmp_path: Path):
    events = long_events(1.0)
    corner = events.replace(x=events.x % 10 + np.where(events.t_us < events.t_us[0] + 200_000, 0, 20).astype(np.uint16))
    write_events(tmp_path / "a.npz", corner, SIZE)
    (tmp_path / "l.csv").write_text("0.1,0.7,hold\n")
    how = Importing(labels=tmp_path / "l.csv", crop=(0, 0, 10, 260))
    made = import_recording(tmp_path / "a.npz", tmp_path / "b.h5", how)
    assert made.last_us < 210_000
    assert [i.end_us - i.start_us for i in made.intervals] == [600_000]
    assert_equal(record_file.read(tmp_path / "b.h5"), made)
    (tmp_path / "l.csv").write_text("0.5,0.7,hold\n")
    with pytest.raises(DataError, match=r"begins at 0\.5 s, but the last event in the crop is at 0\.[12]"):
        import_recording(tmp_path / "a.npz", tmp_path / "b.h5", how)


def late_record() -> Record:
    """A record whose first event comes after the beginning of its time, as those of VT-SNN."""
    return Record(
        kind="recording",
        name="late",
        size=SIZE,
        events=long_events(start_us=1200),
        intervals=(Interval(0, 150_000, "hold"), Interval(150_000, 300_000, "slip")),
        footage=Footage(np.array([0, 20_000]), np.zeros((2, *SIZE[::-1]), np.uint8)),
        notes={"file": "late.mat", "first_event_us": "0"},
    )


def test_the_time_of_a_record_stays_by_an_import(tmp_path: Path):
    record_file.write(tmp_path / "late.h5", late_record())
    assert_equal(import_recording(tmp_path / "late.h5", tmp_path / "again.h5"), late_record())


def test_labels_count_from_the_first_event_of_a_record_too(tmp_path: Path, labels: Path):
    record_file.write(tmp_path / "late.h5", late_record())
    # What is cropped away does not move them.
    crop = (int(late_record().events.x[0]) + 1, 0, 10, 260)
    for how in (Importing(labels=labels), Importing(labels=labels, crop=crop)):
        made = import_recording(tmp_path / "late.h5", tmp_path / "again.h5", how)
        assert [i.start_us for i in made.intervals] == [101_200, 1_001_200, 1_501_200]
        assert made.footage is not None and made.footage.t_us.tolist() == [0, 20_000]
    assert made.events.t_us[-1] < late_record().events.t_us[-1]
    assert made.intervals[-1].end_us == late_record().events.t_us[-1] + 1


def test_a_simulated_record_is_not_labelled_by_hand(tmp_path: Path, labels: Path):
    record_file.write(tmp_path / "a.h5", simulated())
    with pytest.raises(DataError, match="simulated record; only recordings"):
        import_recording(tmp_path / "a.h5", tmp_path / "b.h5", Importing(labels=labels))


@pytest.mark.parametrize("part", [{"crop": (0, 0, 400, 10)}, {"rotate": 45}])
def test_pictures_that_cannot_be_are_refused(tmp_path: Path, part: dict):
    write_events(tmp_path / "a.npz", long_events(), SIZE)
    with pytest.raises(ConfigError):
        import_recording(tmp_path / "a.npz", tmp_path / "b.h5", Importing(**part))


def test_windows_leave_and_enter_the_layout_of_vt_snn(tmp_path: Path, labels: Path):
    write_events(tmp_path / "real.npz", long_events(), SIZE)
    made = import_recording(tmp_path / "real.npz", tmp_path / "record.h5", Importing(labels=labels))
    windows = windows_of([made], WindowSettings(balance=False))
    assert export_windows(windows, tmp_path / "vt") == len(windows) == 10
    assert is_vt_snn(tmp_path / "vt")
    table = scipy.io.loadmat(tmp_path / "vt/prophesee_recordings/rotate_01_td.mat")["td_data"]
    first = windows[int(np.flatnonzero(windows.label == Label.SLIP)[0])]
    np.testing.assert_array_equal(table["ts"][0][0].ravel(), first.t_us)
    np.testing.assert_array_equal(table["p"][0][0].ravel(), np.where(first.p, 1, -1))
    back = open_samples(import_vt_snn(tmp_path / "vt", tmp_path / "back", length_s=0.16)[0].parent)
    assert sorted(back.labels()) == ["hold"] * 7 + ["slip"] * 3
    again = back.windows(WindowSettings(balance=False, left=0, top=0, sensor_width=200, sensor_height=250))
    assert len(again) == 10
    reach = {record.size for record in back}
    assert len(reach) == 1  # a sensor's, not each file's own
    sized = import_vt_snn(tmp_path / "vt", tmp_path / "sized", size=(640, 480))
    assert {sample.size for sample in open_samples(sized[0].parent)} == {(640, 480)}
    with pytest.raises(DataError, match="a new folder"):
        export_windows(windows, tmp_path / "vt")


def test_a_person_states_the_size_where_the_file_does_not(tmp_path: Path):
    events = long_events()
    write_events(tmp_path / "a.csv", events, SIZE)
    width, height = int(events.x.max()) + 1, int(events.y.max()) + 1
    assert import_recording(tmp_path / "a.csv", tmp_path / "a.h5").size == (width, height)
    assert import_recording(tmp_path / "a.csv", tmp_path / "b.h5", Importing(size=(400, 300))).size == (400, 300)
    with pytest.raises(ConfigError, match=f"size: .*a.csv has events on {width} x {height} pixels"):
        import_recording(tmp_path / "a.csv", tmp_path / "c.h5", Importing(size=(width - 1, height)))
    with pytest.raises(ConfigError, match=f"size: .*a.h5 states {width} x {height} pixels"):
        import_recording(tmp_path / "a.h5", tmp_path / "c.h5", Importing(size=(400, 300)))
    assert not (tmp_path / "c.h5").exists()


def test_times_of_the_papers_mat_files_are_seconds(tmp_path: Path):
    table = {"ts": [0.0, 0.000123, 0.1], "x": [1, 2, 3], "y": [1, 2, 3], "p": [1, -1, 1]}
    folder = tmp_path / "prophesee_recordings"
    folder.mkdir()
    scipy.io.savemat(folder / "stable_01_td.mat", {"td_data": table})
    (made,) = import_vt_snn(tmp_path, tmp_path / "out")
    sample = record_file.read(made)
    assert sample.events.t_us.tolist() == [0, 123, 100_000]
    assert sample.intervals == (Interval(0, 150_000, "hold"),)


def pose_table(folder: Path, seconds: float, turn_deg: float, rate: float = 60.0, paper: bool = False) -> np.ndarray:
    """A gripper that moves and tilts, and an object that turns in it about y by turn_deg in the second half."""
    t_s = np.arange(0, seconds + 1e-9, 1 / rate)
    angle = np.radians(turn_deg) * np.clip((t_s / seconds - 0.5) * 2, 0, 1)
    tilt = 0.3 * t_s / seconds
    gripper_turn = np.stack([np.cos(tilt / 2), np.sin(tilt / 2), 0 * t_s, 0 * t_s], 1)
    # quaternion product: the object turns with the hand, then about y in it
    inner = np.stack([np.cos(angle / 2), 0 * t_s, np.sin(angle / 2), 0 * t_s], 1)
    w, x = gripper_turn[:, 0], gripper_turn[:, 1]
    object_turn = np.stack([w * inner[:, 0], x * inner[:, 0], w * inner[:, 2], x * inner[:, 2]], 1)
    place = np.stack([0.4 + 0.1 * t_s, 0 * t_s, 0.2 + 0 * t_s], 1)
    folder.mkdir(parents=True, exist_ok=True)
    if paper:
        rows = [["ts", "end_effector_pos", "end_effector_ori", "cube_pos", "cube_ori", "angular_difference", "frames"]]
        join = " ".join
        for i, t in enumerate(t_s):
            turns = [np.roll(q[i], -1) for q in (gripper_turn, object_turn)]
            cells = [join(map(repr, map(float, v))) for v in (place[i], turns[0], place[i], turns[1])]
            rows.append([str(round(t * 1e9) + 16_666_668), *cells, "0", f"frame_{round(t * 1e9):011}.png"])
        name = "isaac_stats.csv"
    else:
        columns = [
            f"{side}_{part}" for side in ("gripper", "object") for part in ("x", "y", "z", "qw", "qx", "qy", "qz")
        ]
        rows = [["t_s", *columns]]
        for i, t in enumerate(t_s):
            rows.append([repr(float(v)) for v in (t, *place[i], *gripper_turn[i], *place[i], *object_turn[i])])
        name = "poses.csv"
    with (folder / name).open("w", newline="") as file:
        csv.writer(file).writerows(rows)
    return t_s


def frames(folder: Path, count: int, size: tuple[int, int] = (60, 40)) -> None:
    """A bright bar that moves to the right."""
    (folder / "frames").mkdir()
    for i in range(count):
        image = np.full((size[1], size[0], 3), 60, np.uint8)
        image[:, 5 + i % 40 : 15 + i % 40] = 200
        Image.fromarray(image).save(folder / "frames" / f"frame_{i:05d}.png")


@pytest.mark.parametrize("paper", [False, True])
def test_a_simulators_folder_becomes_a_record(tmp_path: Path, paper: bool):
    home = tmp_path / "set000" / ("data" if paper else "")
    times = pose_table(home, 1.0, 8.0, paper=paper)
    frames(home, len(times))
    made = import_recording(tmp_path / "set000", tmp_path / "a.h5", Importing(size=(60, 40)))
    assert made.truth is not None and made.poses is not None and made.footage is not None
    assert made.events.count > 1000
    assert made.notes["events"] == "made by evslip, camera davis346"
    assert (made.name, made.label) == ("set000", "slip")
    angle = np.interp(made.truth.t_us / 1e6, [0, 0.5, 1], [0, 0, 8])
    np.testing.assert_allclose(made.truth.theta_deg, angle, atol=0.03)
    assert 480_000 < (made.truth.onset_us or 0) < 540_000
    assert_equal(record_file.read(tmp_path / "a.h5"), made)
    windows = windows_of([made], WindowSettings(balance=False))
    # 8 deg in 0.5 s are 2.56 deg in 0.16 s; the window that sees only a part of that is in the middle.
    assert windows.label.tolist() in ([Label.HOLD] * 3 + [Label.SLIP] * 3, [Label.HOLD] * 3 + [Label.SLIP] * 2)


def test_a_simulators_own_events_are_taken(tmp_path: Path):
    times = pose_table(tmp_path / "s", 0.5, 0.0, paper=True)
    frames(tmp_path / "s", len(times))
    lines = ["# v2e"] * 6 + ["0.016666 1 2 1", "0.020000 3 4 0", "0.400000 5 6 1"]
    (tmp_path / "s" / "events_v2e.txt").write_text("\n".join(lines) + "\n")
    made = import_recording(tmp_path / "s", tmp_path / "a.h5", Importing(size=(60, 40), crop=(1, 0, 59, 40)))
    # Times count from the first pose, at 16667 us.
    assert made.events.t_us.tolist() == [-1, 3333, 383_333]
    assert made.events.x.tolist() == [0, 2, 4]
    assert made.label == "hold"
    with pytest.raises(ConfigError, match="--size"):
        import_recording(tmp_path / "s", tmp_path / "b.h5", Importing(size=(4, 4), frames=False))


def test_labels_of_a_simulators_folder_count_from_its_first_event(tmp_path: Path):
    times = pose_table(tmp_path / "s", 0.5, 0.0)
    frames(tmp_path / "s", len(times))
    (tmp_path / "s" / "events.txt").write_text("0.100000 1 2 1\n0.400000 5 6 1\n")
    (tmp_path / "l.csv").write_text("0,0.1,slip\n0.2,1,hold\n")
    made = import_recording(tmp_path / "s", tmp_path / "a.h5", Importing(size=(60, 40), labels=tmp_path / "l.csv"))
    assert made.events.t_us.tolist() == [100_000, 400_000]
    assert made.footage is not None
    last_us = int(made.footage.t_us[-1])
    assert made.intervals == (Interval(100_000, 200_000, "slip"), Interval(300_000, last_us + 1, "hold"))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("t_s", "time"), "no column t_s"),
        (("gripper_qw", "gripper_w"), "no column gripper_qw"),
        (("0.4,", "4 m,"), "expected numbers"),
        (("1.0,0.0,0.0,0.0", "2.0,0.0,0.0,0.0"), "quaternions of length .*, expected 1"),
        (("0.016666666666666666", "-1"), "times that increase"),
        (("0.4,", "1e300,"), "numbers below 1,000,000"),
    ],
)
def test_tables_that_hold_no_poses_are_refused(tmp_path: Path, change: tuple[str, str], message: str):
    pose_table(tmp_path, 0.1, 0.0)
    text = (tmp_path / "poses.csv").read_text()
    assert change[0] in text
    (tmp_path / "poses.csv").write_text(text.replace(*change))
    with pytest.raises(DataError, match=message):
        read_poses(tmp_path / "poses.csv")


def test_poses_of_years_are_refused_before_they_are_brought_to_milliseconds(tmp_path: Path):
    pose_table(tmp_path, 0.1, 0.0)
    *rows, last = (tmp_path / "poses.csv").read_text().splitlines()
    last = f"1e6,{last.partition(',')[2]}"
    (tmp_path / "poses.csv").write_text("\n".join([*rows, last]))
    with pytest.raises(DataError, match="a span of 1,000,000 s, expected 3,600 at most"):
        read_poses(tmp_path / "poses.csv")


def test_times_of_poses_may_count_from_1970(tmp_path: Path):
    times = pose_table(tmp_path, 0.1, 0.0)
    header, *rows = (tmp_path / "poses.csv").read_text().splitlines()
    late = [f"{1.7e9 + t:.6f},{row.partition(',')[2]}" for t, row in zip(times, rows, strict=True)]
    (tmp_path / "poses.csv").write_text("\n".join([header, *late]))
    given, _ = read_poses(tmp_path / "poses.csv")
    np.testing.assert_array_equal(given.t_us - given.t_us[0], np.round(times * 1e6).astype(np.int64))


def test_frames_and_poses_must_be_as_many(tmp_path: Path):
    times = pose_table(tmp_path / "s", 0.2, 0.0)
    frames(tmp_path / "s", len(times) - 1)
    with pytest.raises(DataError, match=r"12 images for 13 poses"):
        import_recording(tmp_path / "s", tmp_path / "a.h5")
    with pytest.raises(DataError, match="expected a folder of a simulator"):
        import_recording(tmp_path / "s" / "frames", tmp_path / "a.h5")


def test_the_held_time_and_the_gripped_point_count(tmp_path: Path):
    # The object turns about the fingers, 0.1 m from the origin of the hand: its point there stays where it is.
    n = 200
    angle = np.radians(np.linspace(0, 20, n))
    turn = np.stack([np.cos(angle / 2), 0 * angle, np.sin(angle / 2), 0 * angle], 1)
    hand = np.tile([0, 0, 0, 1.0, 0, 0, 0], (n, 1)).astype(np.float32)
    centre = np.stack([-0.03 * np.sin(angle), 0 * angle, 0.1 - 0.03 * np.cos(angle)], 1)
    poses = Poses(np.arange(n) * 1000, hand, np.hstack([centre, turn]).astype(np.float32))
    held = np.arange(n) >= 50
    truth = truth_of(poses, held, (0, 0, 0.1))
    assert np.ptp(truth.position_m[held], axis=0).max() < 1e-6
    assert truth_of(poses, held).position_m[held].std() > 1e-3
    np.testing.assert_array_equal(truth.held, held)
    with pytest.raises(DataError, match="never held"):
        truth_of(poses, np.zeros(n, bool))


def test_even_poses_go_through_the_given_ones(tmp_path: Path):
    pose_table(tmp_path, 0.3, 30.0, rate=50)
    given, held = read_poses(tmp_path / "poses.csv")
    assert held is None
    dense = even(given)
    assert (np.diff(dense.t_us) == 1000).all()
    np.testing.assert_allclose(dense.object_pose[::20], given.object_pose, atol=1e-6)


def test_a_real_recording_is_imported(tmp_path: Path):
    path = shared("real", "dvxplorer.aedat4")
    (tmp_path / "l.csv").write_text("0,0.2,hold\n0.2,0.55,slip\n")
    made = import_recording(path, tmp_path / "a.h5", Importing(labels=tmp_path / "l.csv", sensor="DVXplorer"))
    assert made.events.t_us[0] == 0
    assert int(made.events.t_us[-1]) == 1605537494308262 - 1605537493718345
    windows = open_samples(tmp_path / "a.h5").windows(WindowSettings(balance=False))
    assert windows.label.tolist() == [Label.HOLD, Label.SLIP, Label.SLIP]
    assert (tmp_path / "a.h5").stat().st_size / made.events.count <= 3.5


def test_a_layout_of_vt_snn_that_cannot_be_written_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    windows, written = slip_windows(), []

    def full(path: Path, *_: object) -> None:
        written.append(path)
        if len(written) > 2:
            raise StorageError("no space left on the disk")
        path.touch()

    monkeypatch.setattr(vt_snn, "write_events", full)
    with pytest.raises(StorageError, match="no space left"):
        export_windows(windows, tmp_path / "vt")
    assert len(written) == 3 and not any((tmp_path / "vt").iterdir())
