"""`evslip control`, as its users see it."""

import json
import subprocess
import sys

import pytest

from evslip.cli import main
from evslip.data import record_file

QUICK = {
    "robot.kind": "cartesian",
    "motion.kind": "hold",
    "motion.duration_s": "7.5",
    "motion.lift_s": "0.5",
    "motion.hold_s": "0.3",
    "disturbance.kind": "none",
    "object.mass_kg": "0.1",
    "object.shape": "cuboid",
    "grip.friction": "0.4",
    "grip.force_n": "1.5",
    "grip.offset": "0.5",
    "camera.width": "48",
    "camera.height": "36",
    "render.max_motion_px": "4.0",
}
POLICY = """
from evslip.control.controllers.controller import Controller

class Squeeze(Controller):
    def reset(self, setup):
        self.force_n = setup.force_n

    def step(self, events, senses):
        self.force_n += 0.02
        return self.force_n
"""


def evslip(*words):
    command = [sys.executable, "-m", "evslip", "control", *map(str, words)]
    return command + [f"--set={key}={value}" for key, value in QUICK.items()]


@pytest.mark.slow
def test_a_policy_of_ones_own_is_compared_recorded_and_filmed(tmp_path):
    (tmp_path / "mine.py").write_text(POLICY)
    words = "--policy", "mine:Squeeze", "--count", 2, "--workers", 1, "--out", "held", "--records", "played"
    done = subprocess.run(evslip(*words, "--videos", 1), cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "mine:Squeeze" in done.stdout and "largest slip" in done.stdout
    found = json.loads((tmp_path / "held" / "control.json").read_text())
    assert set(found["figures"]) == {"constant", "oracle", "mine:Squeeze"}
    rows = [json.loads(line) for line in (tmp_path / "held" / "outcomes.jsonl").read_text().splitlines()]
    assert {(row["controller"], row["index"]) for row in rows} == {
        (name, index) for name in ("constant", "oracle", "mine:Squeeze") for index in (0, 1)
    }
    page = (tmp_path / "held" / "control.html").read_text()
    assert "mine:Squeeze" in page
    failed = [row for row in rows if row["controller"] == "mine:Squeeze" and row["largest_deg"] > 5]
    videos = [path.relative_to(tmp_path / "held") for path in (tmp_path / "held" / "videos").glob("*.mp4")]
    assert len(videos) == min(1, len(failed)) and all(str(path) in page for path in videos)
    records = sorted((tmp_path / "played").glob("*.h5"))
    assert len(records) == 6
    assert record_file.read(records[0]).index == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--controller fuzzy", "controller: 'fuzzy' is unknown"),
        ("--policy nothing:Here", "nothing:Here cannot be loaded"),
        ("--rate-hz 60", "rate_hz: 60 is wrong"),
        ("--count 0", "count: 0 is out of range"),
        ("--count 1000000000", "count: 1000000000 is out of range, expected 1 to 100,000"),
        ("--videos -1", "videos: -1 is out of range, expected 0 to"),
        ("--workers 0", "workers: 0 is out of range, expected 1 to"),
        ("--records /dev/null/played", "cannot write /dev/null/played"),
        ("--controller constant --controller strong --parameter force_n=2", "2 controllers are named"),
        ("--controller oracle --parameter margin=2", "oracle is what the others are compared with"),
        ("--policy=", "controller: '' is unknown"),
        ("--controller strong --parameter force_n=2 --parameter x", "override 'x': expected KEY=VALUE"),
        ("--set render.renderer=pathtrace --records /tmp", "render.renderer: pathtrace: draws nothing live"),
        ("--set camera.width=100", "the camera has 100x260; expected camera.width = 346"),
        ("--set camera.left={} --set camera.right={}", "camera.left, camera.right: the closed loop has one camera"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(words, said, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["evslip", "control", *words.split(), "--out", str(tmp_path / "held")])
    with pytest.raises(SystemExit) as stop:
        main()
    assert stop.value.code == 2
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1
    assert not (tmp_path / "held").exists()
