"""Windows against analytic movements, and their file against damage."""

import contextlib
import subprocess
import sys
from dataclasses import replace

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evslip.data.intervals import Interval
from evslip.data.record import Record
from evslip.events.frame import BACKGROUND, OBJECT
from evslip.events.stream import empty_events
from evslip.utils.errors import ConfigError, DataError, StorageError
from evslip.windows.cutting import Movement, label_of, movements, windows_of
from evslip.windows.label import Label
from evslip.windows.settings import LabelMode
from evslip.windows.window_set import Windows, WindowSettings, open_windows
from slip_records import HELD, STEPS, slip_record, slip_records, slip_windows, truth_of, turning

ALL = WindowSettings(balance=False)
PER_RECORD = (HELD.stop - HELD.start) // 160


def slipping() -> Record:
    """Turns at 12 deg/s from 1 s on."""
    return slip_record("slips", turning(1000, 2000, 12.0))


def holding() -> Record:
    return slip_record("holds", np.zeros(STEPS), seed=1)


@pytest.fixture(scope="module")
def windows() -> Windows:
    return slip_windows()


@given(rate=st.floats(-50, 50), begin=st.integers(0, STEPS), end=st.integers(0, STEPS), slide=st.floats(-20, 20))
@settings(max_examples=40)
def test_movement_of_a_constant_turn_and_slide(rate: float, begin: int, end: int, slide: float) -> None:
    clock = np.clip(np.arange(STEPS), min(begin, end), max(begin, end)) / 1e3
    truth = truth_of(rate * clock, slide * clock)
    for start_us, rotation, translation, rise, *speeds in movements(truth, ALL):
        first = start_us // 1000
        spent = clock[first + 160] - clock[first]
        assert rotation == pytest.approx(abs(rate) * spent, abs=1e-5)
        assert translation == pytest.approx(abs(slide) * spent, abs=1e-6)
        assert rise == pytest.approx(abs(rate) * spent, abs=1e-5)  # theta is a magnitude: here it can only grow
        share = (clock[first + 160] - clock[first + 140]) / 0.02
        assert speeds == pytest.approx([abs(rate) * share, abs(slide) * share], abs=1e-3)


def test_a_slip_that_lowers_theta_counts_and_so_does_one_that_returns() -> None:
    """The public code clips falling theta to 0; a movement there and back shows only inside the window."""
    falling = movements(truth_of(20 - np.arange(STEPS) * 0.02), ALL)
    assert all(rotation == pytest.approx(3.2, abs=1e-5) for _, rotation, *_ in falling)
    triangle = 2.0 * np.abs((np.arange(STEPS) - HELD.start) % 160 / 80 - 1)
    assert all(rotation == pytest.approx(2, abs=1e-5) for _, rotation, *_ in movements(truth_of(triangle), ALL))


@given(st.floats(0.01, 0.4), st.integers(10, 500), st.integers(0, 700), st.integers(200, 700))
@settings(max_examples=40)
def test_windows_lie_in_the_held_time(length_s: float, hop: int, first: int, duration: int) -> None:
    truth = truth_of(np.zeros(STEPS), held=slice(first, first + duration))
    found = movements(truth, WindowSettings(length_s=length_s, hop_s=hop / 1e3))
    length = round(length_s * 1e3)
    assert len(found) == max(0, (duration - 1 - length) // hop + 1)  # both end poses are held
    assert all(first * 1000 <= start and start + length * 1000 <= (first + duration) * 1000 for start, *_ in found)


@pytest.mark.parametrize("label_s", [0.04, 0.16, 0.0])
def test_only_the_newest_part_counts_for_the_label(label_s: float) -> None:
    """The first window's turn and slide end 50 ms before its end, the second one's 30 ms before."""
    counted = round(1e3 * (label_s or 0.16))
    angle = turning(HELD.start, HELD.start + 110, 20.0) - turning(HELD.start + 160 + 100, HELD.start + 160 + 130, 50.0)
    slide = turning(HELD.start, HELD.start + 110, 10.0)
    cut = movements(truth_of(angle, slide), replace(ALL, label_s=label_s))
    for k, movement in enumerate(cut[:2]):
        part = slice(HELD.start + 160 * (k + 1) - counted, HELD.start + 160 * (k + 1) + 1)
        turned, slid = np.abs(angle[part] - angle[part][0]), np.abs(slide[part] - slide[part][0])
        assert movement.rotation_deg == pytest.approx(turned.max(), abs=1e-5)
        assert movement.translation_mm == pytest.approx(slid.max(), abs=1e-6)
    labels = [label_of(movement, ALL) for movement in cut[:2]]
    assert labels == [Label.HOLD if label_s == 0.04 else Label.SLIP, Label.SLIP]


def test_never_held_gives_no_window() -> None:
    assert movements(truth_of(np.zeros(STEPS), held=slice(0, 0)), ALL) == []


@given(st.floats(0, 3), st.floats(0, 5), st.floats(0, 3))
def test_labels(rotation: float, translation: float, rise: float) -> None:
    movement = Movement(0, rotation, translation, rise, 0.0, 0.0)
    label = label_of(movement, ALL)
    assert (label == Label.SLIP) == (rotation >= 1 or translation >= 2)
    assert (label == Label.HOLD) == (rotation < 0.1 and translation < 0.1)
    equal = WindowSettings(slip_deg=0.5, hold_deg=0.5, slip_mm=1, hold_mm=1)
    assert label_of(movement, equal) != Label.UNCERTAIN
    by_mode = (WindowSettings(labels="angular"), rotation), (WindowSettings(labels="paper"), rise)
    for mode, angle in by_mode:
        label = label_of(movement, mode)
        assert (label == Label.SLIP) == (angle >= 1)
        assert (label == Label.HOLD) == (angle < 0.1)


def test_the_modes_differ_where_they_should() -> None:
    """Of a slide, a turn that lowers theta and one that raises it, each in windows of its own."""
    slide = turning(260, 420, 20.0)  # mm
    angle = turning(740, 900, 20.0) - turning(1220, 1380, 20.0)
    record = replace(slip_record("mixed", angle), truth=truth_of(angle, slide))

    def slips(mode: LabelMode) -> list[int]:
        windows = windows_of([record], WindowSettings(labels=mode, balance=False))
        return (windows.start_us[windows.label == Label.SLIP] // 1000).tolist()

    assert slips("motion") == [260, 740, 1220]
    assert slips("angular") == [740, 1220]
    assert slips("paper") == [740]


def test_events_are_the_record_s_cropped_and_from_zero() -> None:
    record = slipping()
    windows = windows_of([record], ALL)
    events = record.events
    assert len(windows) > 3
    for i, window in enumerate(windows[i] for i in range(len(windows))):
        start = windows.start_us[i]
        inside = (events.t_us >= start) & (events.t_us < start + 160_000)
        inside &= (events.x >= 73) & (events.x < 273) & (events.y >= 10)
        np.testing.assert_array_equal(window.t_us, events.t_us[inside] - start)
        np.testing.assert_array_equal(window.x, events.x[inside] - 73)
        np.testing.assert_array_equal(window.y, events.y[inside] - 10)
        np.testing.assert_array_equal(window.p, events.p[inside])
        assert events.body is not None
        for body in (BACKGROUND, OBJECT):
            assert windows.by_body[i, body] == (events.body[inside] == body).sum()


def test_labels_counts_and_the_flag_of_a_known_slip() -> None:
    windows = windows_of([slipping(), holding()], ALL)
    slips = windows.name == "slips"
    inside = np.clip(windows.start_us + 160_000, 1e6, 2e6) - np.clip(windows.start_us, 1e6, 2e6)
    np.testing.assert_allclose(windows.rotation_deg[slips], 12 * inside[slips] / 1e6, atol=1e-4)
    np.testing.assert_array_equal(windows.label[slips], 12 * inside[slips] / 1e6 >= 1)
    before = np.clip(windows.start_us, 1e6, 2e6) - np.clip(windows.start_us - 200_000, 1e6, 2e6)
    np.testing.assert_array_equal(windows.recent[slips], 12 * before[slips] / 1e6 >= 0.1)
    assert not windows.label[~slips].any() and not windows.recent[~slips].any()
    assert len(windows) + windows.dropped == 2 * PER_RECORD


def test_slow_movement_is_dropped_and_counted() -> None:
    slow = replace(holding(), name="slow", truth=truth_of(np.arange(STEPS) * 3e-3))
    windows = windows_of([slow, slipping()], ALL)
    assert windows.dropped >= PER_RECORD and not (windows.name == slow.name).any()


def test_a_window_without_events_is_a_window() -> None:
    silent = replace(holding(), events=empty_events())
    windows = windows_of([silent, slipping()], ALL)
    empty = windows.name == silent.name
    assert empty.sum() == PER_RECORD
    assert all(len(windows[int(i)].t_us) == 0 for i in np.flatnonzero(empty))


def test_records_without_truth_are_passed_over() -> None:
    recording = replace(slipping(), name="real", kind="recording", truth=None)
    assert set(windows_of([recording, holding()], ALL).name) == {"holds"}
    with pytest.raises(DataError, match=r"no window of 0\.16 s"):
        windows_of([recording])


def test_balance_removes_only_the_commoner_label_and_obeys_the_seed() -> None:
    everything, balanced, again, other = (
        slip_windows(balance=False),
        slip_windows(),
        slip_windows(),
        slip_windows(seed=1),
    )
    slips = int((everything.label == Label.SLIP).sum())
    assert 0 < slips < len(everything) / 2
    assert (balanced.label == Label.SLIP).sum() == (balanced.label == Label.HOLD).sum() == slips
    key = [f"{n} {s}" for n, s in zip(balanced.name, balanced.start_us, strict=True)]
    assert key == [f"{n} {s}" for n, s in zip(again.name, again.start_us, strict=True)]
    assert key != [f"{n} {s}" for n, s in zip(other.name, other.start_us, strict=True)]
    half_as_many_more = slip_windows(ratio=1.5)
    assert (half_as_many_more.label == Label.SLIP).sum() == slips
    assert (half_as_many_more.label == Label.HOLD).sum() == min(
        round(1.5 * slips), (everything.label == Label.HOLD).sum()
    )
    with pytest.raises(ConfigError, match=r"ratio 0\.5: expected 1 to 1000"):
        slip_windows(ratio=0.5)


@given(fraction=st.floats(0.05, 0.6), seed=st.integers(0, 2**31))
@settings(max_examples=25)
def test_split_never_shares_a_trajectory(windows: Windows, fraction: float, seed: int) -> None:
    first, second = windows.split_by_trajectory(fraction, seed)
    assert not set(first.name) & set(second.name)
    assert set(first.name) | set(second.name) == set(windows.name)
    assert len(first) + len(second) == len(windows)
    for part in (first, second):
        assert set(part.label) == {Label.HOLD, Label.SLIP}
        for i in (0, len(part) - 1):
            j = int(np.flatnonzero((windows.name == part.name[i]) & (windows.start_us == part.start_us[i]))[0])
            np.testing.assert_array_equal(part[i].t_us, windows[j].t_us)


def test_too_few_trajectories_to_split() -> None:
    with pytest.raises(DataError, match="too few"):
        slip_windows(count=2).split_by_trajectory(0.2)


def test_file_round_trip_has_equal_content_and_bytes(windows: Windows, tmp_path) -> None:
    windows.save(tmp_path / "one.h5")
    back = open_windows(tmp_path / "one.h5")
    back.save(tmp_path / "two.h5")
    assert back.settings == windows.settings and back.dropped == windows.dropped
    for i in range(len(windows)):
        for one, other in zip(back[i].columns, windows[i].columns, strict=True):
            np.testing.assert_array_equal(one, other)
            assert one.dtype == other.dtype
    for name in Windows.__dataclass_fields__.keys() - {"packed", "first", "last"}:
        value = getattr(windows, name)
        if isinstance(value, np.ndarray):
            np.testing.assert_array_equal(getattr(back, name), value)
            assert getattr(back, name).dtype.kind == value.dtype.kind
    assert (tmp_path / "one.h5").read_bytes() == (tmp_path / "two.h5").read_bytes()


@pytest.fixture
def saved(windows: Windows, tmp_path):
    windows.save(tmp_path / "windows.h5")
    return tmp_path / "windows.h5"


@pytest.mark.parametrize("share", [0.0, 0.01, 0.3, 0.9, 0.999])
def test_truncated_file(saved, share: float) -> None:
    data = saved.read_bytes()
    saved.write_bytes(data[: int(len(data) * share)])
    with pytest.raises(DataError, match=r"windows\.h5"):
        open_windows(saved)


def test_foreign_missing_and_folder(saved, tmp_path) -> None:
    with pytest.raises(DataError, match="absent"):
        open_windows(tmp_path / "absent.h5")
    with pytest.raises(DataError):
        open_windows(tmp_path)
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["x"] = [1, 2]
    with pytest.raises(DataError, match="not one that `evslip windows` wrote"):
        open_windows(tmp_path / "other.h5")
    (tmp_path / "text.h5").write_text("hello")
    with pytest.raises(DataError, match="not an HDF5 file"):
        open_windows(tmp_path / "text.h5")


def test_speeds_are_of_the_last_20_ms_and_nan_where_a_person_labelled(tmp_path) -> None:
    """A slip that stops within a window; one that is entered while it goes on; a labelled recording."""
    stopped = movements(truth_of(turning(1000, 1210, 21.0)), WindowSettings(hop_s=0.01))
    by_end = {movement.start_us // 1000 + 160: movement.rotation_speed_deg_s for movement in stopped}
    assert [by_end[end] for end in (1010, 1100, 1220, 1230)] == pytest.approx([50, 100, 50, 0], abs=1e-3)
    first = movements(truth_of(turning(0, 1000, 100.0)), WindowSettings(hop_s=0.01), entering=True)[0]
    assert first.start_us < 1000 * HELD.start and first.rotation_speed_deg_s == pytest.approx(100, abs=1e-3)
    recording = replace(
        slip_record("real", turning(500, 900, 9.0), seed=3), intervals=(Interval(10**6, 2 * 10**6, "hold"),)
    )
    windows = windows_of([slipping(), recording], ALL)
    windows.save(tmp_path / "both.h5")
    back = open_windows(tmp_path / "both.h5")
    for values in (back.rotation_speed_deg_s, back.slide_speed_mm_s):
        np.testing.assert_array_equal(np.isnan(values), windows.name == "real")


def test_a_file_from_before_the_speeds_opens(saved, windows: Windows) -> None:
    assert np.isfinite(open_windows(saved).rotation_speed_deg_s).all()
    with h5py.File(saved, "r+") as file:
        del file["rotation_speed_deg_s"], file["slide_speed_mm_s"]
    back = open_windows(saved)
    assert np.isnan(back.rotation_speed_deg_s).all() and np.isnan(back.slide_speed_mm_s).all()
    assert len(back[::2].slide_speed_mm_s) == len(back[::2]) and back[3] == windows[3]


def test_a_file_from_before_the_modes_has_the_default_one(saved, windows: Windows) -> None:
    with h5py.File(saved, "r+") as file:
        del file.attrs["labels"], file.attrs["ratio"]
    assert open_windows(saved).settings == windows.settings


def test_a_file_from_before_hops_were_whole_milliseconds_has_the_one_that_was_taken(saved) -> None:
    with h5py.File(saved, "r+") as file:
        file.attrs["hop_s"] = 0.0216
    assert open_windows(saved).settings.hop_s == 0.022


def test_another_version(saved) -> None:
    with h5py.File(saved, "r+") as file:
        file.attrs["version"] = 99
    with pytest.raises(DataError, match="version 99"):
        open_windows(saved)


@pytest.mark.parametrize(
    ("name", "value"),
    [("label", 2), ("first", -1), ("first", 10**12), ("last", 10**12), ("events", -1), ("events", 10**12)],
)
def test_arrays_that_contradict_one_another(saved, name: str, value: int) -> None:
    with h5py.File(saved, "r+") as file:
        file[name][3] = value  # pyright: ignore[reportIndexIssue]
    with pytest.raises(DataError, match="contradict"):
        open_windows(saved)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        *((name, np.nan, f"{name}: .*nan") for name in ("length_s", "hop_s", "slip_deg", "hold_mm")),
        ("slip_deg", np.inf, "slip_deg"),
        ("length_s", "long", "length_s: 'long' is wrong; expected a finite number"),
        ("left", 1.5, "left: '1.5' is wrong; expected a whole number"),
        ("width", [200, 200], "width"),
        ("balance", 1, "balance: '1' is wrong; expected true or false"),
        ("labels", 3, "labels: '3' is wrong; expected a word"),
        ("labels", "best", "labels 'best': expected one of"),
        ("seed", -1, "seed -1"),
        ("left", -50, "reaches beyond the sensor of 346x260"),
        ("top", 200, "reaches beyond"),
        ("sensor_width", 100, "reaches beyond the sensor of 100x260"),
        ("sensor_height", 0, "sensor of 346x0"),
        ("version", "2", "attribute version"),
        ("dropped", np.nan, "attribute dropped"),
    ],
)
def test_settings_of_a_file_are_checked(saved, name: str, value: object, message: str) -> None:
    with h5py.File(saved, "r+") as file:
        file.attrs[name] = value
    with pytest.raises(DataError, match=message) as caught:
        open_windows(saved)
    assert str(saved) in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["rotation_deg", "translation_mm", "rotation_speed_deg_s", "slide_speed_mm_s"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -1.0])
def test_movement_that_is_no_number(saved, name: str, value: float) -> None:
    with h5py.File(saved, "r+") as file:
        file[name][3] = value  # pyright: ignore[reportIndexIssue]
    with pytest.raises(DataError, match=f"{name}: .* of window 3"):
        open_windows(saved)


def test_a_missing_setting_is_named(saved) -> None:
    with h5py.File(saved, "r+") as file:
        del file.attrs["hop_s"]
    with pytest.raises(DataError, match="hop_s is missing; expected all settings"):
        open_windows(saved)


def test_a_record_comes_but_once() -> None:
    one, two = slip_records(2)
    with pytest.raises(DataError, match=rf"{one.name}: two records have this name"):
        windows_of([one, two, one])
    with pytest.raises(DataError, match=rf"copy: is {one.name} once more"):
        windows_of([one, two, replace(one, name="copy")])


def test_no_window_begins_after_the_recording() -> None:
    record = slip_records(1)[0]
    said = (Interval(2_000_000, 9_000_000, "hold"),)
    record = replace(record, kind="recording", truth=None, intervals=said)
    assert windows_of([record], ALL).start_us.max() <= record.last_us < 2_400_000


def test_a_truth_of_one_moment_has_no_window() -> None:
    record = slip_records(1)[0]
    assert record.truth is not None
    names = ("t_us", "theta_deg", "rotation", "position_m", "held")
    truth = record.truth._replace(**{name: getattr(record.truth, name)[200:201] for name in names})
    assert truth.held.all() and movements(truth, ALL) == []


def test_flipped_bits_are_found(saved, windows: Windows) -> None:
    data = saved.read_bytes()
    rng = np.random.default_rng(0)
    for place in rng.integers(0, len(data), 40):
        damaged = bytearray(data)
        damaged[place] ^= 1 << int(rng.integers(8))
        saved.write_bytes(bytes(damaged))
        try:
            back = open_windows(saved)
        except DataError:
            continue
        # A bit that nothing reads: then nothing has changed.
        assert np.array_equal(back.label, windows.label) and np.array_equal(back.name, windows.name)
        for i in range(len(windows)):
            with contextlib.suppress(DataError):
                assert back[i] == windows[i]


def test_unwritable_place(windows: Windows, tmp_path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(StorageError, match="cannot write"):
        windows.save(tmp_path / "file" / "windows.h5")


@pytest.mark.parametrize(
    "wrong",
    [
        {"seed": 10**70},
        {"labels": "best"},
        {"length_s": 0},
        {"hop_s": -1},
        {"hop_s": 0.0015},
        {"label_s": -0.1},
        {"label_s": 0.2},
        {"hold_deg": 2.0},
        {"hold_mm": 3.0},
        {"width": 0},
        {"width": 8400},
        {"height": 0},
        {"left": 346},
        {"top": -250},
    ],
)
def test_wrong_settings(wrong: dict) -> None:
    with pytest.raises(ConfigError):
        WindowSettings(**wrong)


def test_the_learning_half_never_imports_the_physics_nor_windows_torch() -> None:
    script = (
        "import sys, evslip.windows.cutting; assert 'torch' not in sys.modules; import evslip.learn; "
        "assert not {'mujoco', 'evslip.physics.simulation', 'evslip.physics.scene_model'} & set(sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 0


@pytest.mark.parametrize("fold", [-1, 5, 0.5, float("nan")])
def test_there_are_five_folds(windows: Windows, fold: float) -> None:
    with pytest.raises(ConfigError, match=r"fold .*: expected 0, 1, 2, 3 or 4"):
        windows.split_as_paper(fold)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("fraction", [0, 1, -0.5, 2, float("nan"), float("inf")])
def test_a_side_of_a_split_is_a_fraction(windows: Windows, fraction: float) -> None:
    with pytest.raises(ConfigError, match=r"fraction .*: expected more than 0 and less than 1"):
        windows.split_by_trajectory(fraction)


@pytest.mark.parametrize("ratio", [0, -1, float("nan"), float("inf")])
def test_a_ratio_of_labels_is_above_0(windows: Windows, ratio: float) -> None:
    with pytest.raises(ConfigError, match=r"ratio .*: expected more than 0, and finite"):
        windows.balanced(ratio=ratio)


def test_the_smallest_ratio_leaves_one_of_each_and_the_largest_all(windows: Windows) -> None:
    assert np.bincount(windows.balanced(ratio=1e-3).label).tolist() == [1, 1]
    assert len(windows.balanced(ratio=1e308)) == len(windows)
    holds = windows[windows.label == Label.HOLD]
    assert len(holds.balanced(ratio=1e-3)) == len(holds)
