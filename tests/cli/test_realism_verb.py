"""`evslip realism`: two files, or a recording with frames and a preset."""

import json
from dataclasses import replace

import numpy as np
import pytest

from evslip.cli import run
from evslip.codecs import write_events
from evslip.data import record_file
from evslip.data.footage import Footage
from evslip.data.record import Record
from evslip.events import EventCamera
from evslip.utils.errors import EvslipError

SIZE = (64, 48)


def frames(count: int, step_us: float, start_us: float = 0.0) -> list[tuple[float, np.ndarray]]:
    """A soft pattern that glides by 200 pixels a second, uint8."""
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    made = []
    for number in range(count):
        t_us = start_us + number * step_us
        u = x - 2e-4 * t_us
        made.append((t_us, np.rint(120 + 60 * np.sin(u / 3) + 50 * np.cos(u / 5 + y / 4)).astype(np.uint8)))
    return made


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """A recording with a frame each 40 ms, whose events an own camera made of frames each millisecond."""
    events = EventCamera("clean", size=SIZE, intensity="uint8").run(frames(400, 1000.0))
    slow = frames(10, 40_000.0)
    footage = Footage(np.array([round(t) for t, _ in slow]), np.stack([image for _, image in slow]))
    path = tmp_path_factory.mktemp("realism") / "rec.h5"
    record_file.write(path, Record(kind="recording", name="rec", size=SIZE, events=events, footage=footage))
    return path


def test_frames_years_apart_are_refused_before_their_noise_is_made(recording, tmp_path):
    record = record_file.read(recording)
    footage = record.footage._replace(t_us=record.footage.t_us * 10**9)
    times = np.linspace(0, footage.t_us[-1], len(record.events)).astype(np.int64)
    far = replace(record, footage=footage, events=record.events.replace(t_us=times))
    record_file.write(tmp_path / "far.h5", far)
    words = ["realism", str(tmp_path / "far.h5"), "--camera", "noisy", "--interpolate", "linear"]
    with pytest.raises(EvslipError, match=r"end-s: .* million noise events"):
        run([*words, "--out", str(tmp_path / "r.html")])


def figures(folder, *words: str) -> dict:
    run(["realism", *map(str, words), "--json", str(folder / "r.json"), "--out", str(folder / "r.html")])
    return json.loads((folder / "r.json").read_text())


def test_the_sensor_that_made_the_events_comes_near_with_flow_not_with_lines(recording, tmp_path, capsys):
    pytest.importorskip("cv2")
    words = (recording, "--camera", "clean", "--no-classifier")
    flow = figures(tmp_path, *words)
    line = figures(tmp_path, *words, "--interpolate", "linear")
    # The recording's own draw of the thresholds is that of seed 0: flow may come below the floor of two draws.
    assert flow["l1_per_event"] < 0.1 < 0.3 < line["l1_per_event"]
    assert flow["correlation"] > 0.98
    assert 0.9 < flow["total"] < 1.1
    assert flow["ks"] < 0.1 < line["ks"]
    assert flow["floor"] > 0
    assert {row["level"] for row in flow["rate_by_level"]} == {"0-40", "40-80", "80-160", "160-250", "saturated"}
    assert flow["two_sample_accuracy"] is None
    said = capsys.readouterr().out
    assert "L1/N, 4 x 4 pixels, 40 ms" in said
    page = (tmp_path / "r.html").read_text()
    assert page.count("<figure>") == 6
    assert page.count("<img ") == 18


def test_two_files_are_compared_on_one_clock_or_from_their_first_events(recording, tmp_path):
    events = record_file.read(recording).events
    write_events(tmp_path / "same.h5", events, SIZE)
    write_events(tmp_path / "later.h5", events.replace(t_us=events.t_us + 10**9), SIZE)
    for name in ("same.h5", "later.h5"):
        found = figures(tmp_path, recording, tmp_path / name, "--start-s", "0.1", "--end-s", "0.3", "--no-classifier")
        assert (found["l1_per_event"], found["total"], found["ks"]) == (0, 1, 0)
        assert (found["start_s"], found["end_s"], found["floor"]) == (0.1, 0.3, None)


def test_the_numbers_of_a_run_are_those_of_the_next(recording, tmp_path):
    words = (recording, "--camera", "davis346", "--interpolate", "linear", "--seed", "3")
    first = figures(tmp_path, *words)
    assert first == figures(tmp_path, *words)
    assert first["two_sample_accuracy"] > 0.5


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((), "nothing given; expected a recording"),
        (("{rec}",), "expected a recording and a file of simulated events, or a recording and --camera"),
        (("{rec}", "{rec}", "--camera", "clean"), "with --camera clean; expected"),
        (("{rec}", "--camera", "clear"), "davis346"),
        (("{rec}", "--camera", "clean", "--start-s", "0.3", "--end-s", "0.2"), "start-s, end-s: 0.3 to 0.2 s"),
        (("{rec}", "--camera", "clean", "--end-s", "9"), "within that of the frames, .* to 0.36"),
        (("{rec}", "--camera", "clean", "--start-s", "nan"), "expected a start from 0 on"),
        (("{plain}", "--camera", "clean"), "has no frames that a camera could see"),
        (("{rec}", "{rec}", "--seed", "-1"), "^seed: -1 is out of range, expected 0 to"),
        (("{rec}", "{rec}", "--seed", "99999999999999999999"), "^seed: 99999999999999999999 is out of range"),
        (("{rec}", "{other}"), "other.h5: a sensor of 30x20 pixels, the other file's has 64x48"),
        (("{rec}", "{empty}"), "empty.h5: holds no events"),
        (("{empty}", "{rec}"), "empty.h5: holds no events"),
    ],
)
def test_what_is_wrong_is_said(words, message, recording, tmp_path):
    events = record_file.read(recording).events
    write_events(tmp_path / "plain.h5", events, SIZE)
    write_events(tmp_path / "other.h5", events.select((events.x < 30) & (events.y < 20)), (30, 20))
    write_events(tmp_path / "empty.h5", events[:0], SIZE)
    places = {name: tmp_path / f"{name}.h5" for name in ("plain", "other", "empty")} | {"rec": recording}
    out = tmp_path / "r.html"
    with pytest.raises(EvslipError, match=message):
        run(["realism", *(word.format(**places) for word in words), "--out", str(out), "--no-classifier"])
    assert not out.exists()
