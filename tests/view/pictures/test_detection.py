"""The picture of a detector's answers: what is known is shaded where it belongs."""

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from evslip.data.intervals import Interval
from evslip.learn.speed_estimate import SpeedEstimate
from evslip.learn.streaming.stream import Detection
from evslip.utils.errors import StorageError
from evslip.view.pictures.detection import MOST_POINTS, detection_png, write_detection
from slip_records import slip_record, turning

ENDS = ("", "_low", "_high")
ORANGE, GREEN = (249, 229, 204), (206, 232, 226)
"""#e07b00 and #0a8f6c, a fifth of each on white."""


@pytest.fixture
def silent() -> Detection:
    """Of a recording from 10 s to 12 s of its own clock; it never says slip."""
    t_us = np.arange(10_160_000, 12_000_001, 20_000)
    return Detection(t_us, np.zeros(len(t_us), np.float32), np.zeros(len(t_us), np.int64), 0.5, 10_000_000)


def columns_of(path: Path, color: tuple[int, int, int]) -> np.ndarray:
    """In which columns of the picture's upper half a colour stands, as shares of the axes' width."""
    picture = np.asarray(Image.open(io.BytesIO(path.read_bytes())).convert("RGB")).astype(int)
    upper = picture[60:250]
    close = (np.abs(upper - color) <= 3).all(axis=2).sum(axis=0) > 100
    frame = np.flatnonzero((upper < 30).all(axis=2).sum(axis=0) > 150)
    return (np.flatnonzero(close) - frame[0]) / (frame[-1] - frame[0])


def test_labels_are_shaded_at_their_times(silent: Detection, tmp_path: Path):
    intervals = (Interval(10_500_000, 11_000_000, "slip"), Interval(11_200_000, 11_800_000, "hold"))
    (tmp_path / "a.png").write_bytes(detection_png(silent, "labelled", intervals=intervals))
    shown = (10_160_000, 12_000_000)
    for color, (start, end, _) in zip((ORANGE, GREEN), intervals, strict=True):
        found = columns_of(tmp_path / "a.png", color)
        wanted = [(t - shown[0]) / (shown[1] - shown[0]) for t in (start, end)]
        assert [found.min(), found.max()] == pytest.approx(wanted, abs=0.01)


def test_without_labels_the_true_slips_are_shaded(silent: Detection, tmp_path: Path):
    truth = slip_record("a", turning(700, 1700, 20.0)).truth
    assert truth is not None
    truth = truth._replace(onset_us=10_500_000, episodes=(), t_us=truth.t_us + 10_000_000)
    (tmp_path / "a.png").write_bytes(detection_png(silent, truth=truth))
    assert columns_of(tmp_path / "a.png", ORANGE).min() == pytest.approx(0.34 / 1.84, abs=0.01)
    (tmp_path / "b.png").write_bytes(
        detection_png(silent, truth=truth, intervals=[Interval(11_000_000, 11_500_000, "hold")])
    )
    assert not len(columns_of(tmp_path / "b.png", ORANGE))
    (tmp_path / "c.png").write_bytes(detection_png(silent))
    assert not len(columns_of(tmp_path / "c.png", ORANGE))


def test_the_table_counts_from_the_first_event(silent: Detection, tmp_path: Path):
    write_detection(silent, tmp_path / "a.csv", tmp_path / "a.png")
    lines = (tmp_path / "a.csv").read_text().splitlines()
    assert lines[0] == "t_us,t_s,p_slip,slip,events"
    assert lines[1] == "10160000,0.160000,0.000000,0,0"
    assert len(lines) == 1 + len(silent.t_us)


def test_speeds_stand_in_the_table_and_the_picture(silent: Detection, tmp_path: Path):
    truth = slip_record("a", turning(700, 1700, 20.0)).truth
    n = len(silent.t_us)
    slow, fast = (SpeedEstimate(np.full(n, speed, np.float32), np.full(n, 0.5, np.float32)) for speed in (0.0, 20.0))
    known = replace(silent, rotation_speed=fast, slide_speed=slow)
    write_detection(known, tmp_path / "a.csv", tmp_path / "a.png", truth=truth)
    lines = (tmp_path / "a.csv").read_text().splitlines()
    assert lines[0].split(",")[5:] == [f"{name}{end}" for name in ("rotation_deg_s", "slide_mm_s") for end in ENDS]
    median, low, high, *slide = map(float, lines[1].split(",")[5:])
    assert (median, slide[:2]) == (20, [0, 0]) and 0 < low < median < high
    heights = [Image.open(io.BytesIO(detection_png(one))).height for one in (silent, known)]
    assert heights[1] > 1.5 * heights[0]


def test_the_table_and_the_picture_appear_together_or_not_at_all(silent: Detection, tmp_path: Path):
    write_detection(silent, tmp_path / "a.csv", tmp_path / "a.png")
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    (tmp_path / "b.png").mkdir()  # in the picture's way
    with pytest.raises(StorageError, match=r"b\.png"):
        write_detection(silent, tmp_path / "b.csv", tmp_path / "b.png")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.csv", "a.png", "b.png"]


def test_of_many_answers_the_greatest_are_drawn(tmp_path: Path):
    n = 20 * MOST_POINTS
    p_slip = np.zeros(n, np.float32)
    p_slip[n // 2] = 1.0
    many = Detection(np.arange(n) * 1000, p_slip, np.zeros(n, np.int64), 0.5)
    drawn = np.asarray(Image.open(io.BytesIO(detection_png(many))).convert("RGB")).astype(int)
    red = (np.abs(drawn[60:250] - (214, 39, 40)) < 60).all(axis=2)
    assert red.any(axis=1)[:40].any()  # the one peak reaches the top
