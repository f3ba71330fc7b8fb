"""The examples as a reader would run them; where a machine lacks what one needs, it must say so."""

import importlib.util
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from evslip.codecs import read_events, write_events
from evslip.control.controllers.controller import Setup
from evslip.windows.window_set import open_windows
from notebooks import run
from sample_records import random_events

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


def example(name: str, *arguments: object, timeout: float = 300) -> subprocess.CompletedProcess:
    command = [sys.executable, str(EXAMPLES / name), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=timeout, check=False)


def test_a_camera_in_a_mujoco_simulation(tmp_path):
    result = example("mujoco_any_scene.py", tmp_path / "e.h5", "--seconds", 0.05)
    if result.returncode:
        assert "OpenGL" in result.stderr
        assert "Traceback" not in result.stderr
        pytest.skip("no OpenGL on this machine")
    # The scene is still but for a box that falls: it gains 0.5 m/s.
    assert read_events(tmp_path / "e.h5").count > 1000


def test_a_camera_before_a_gymnasium_environment(tmp_path):
    result = example("gymnasium_frames.py", tmp_path / "e.h5", "--steps", 10)
    if not all(map(importlib.util.find_spec, ("gymnasium", "pygame"))):
        assert result.returncode == 1
        assert "pip install" in result.stderr.strip().splitlines()[-1]
        assert "Traceback" not in result.stderr
    else:
        assert result.returncode == 0, result.stderr
        assert read_events(tmp_path / "e.h5").count > 100


def test_another_simulator_joins(tmp_path):
    result = example("other_simulator.py", tmp_path, "--seconds", 1)
    assert result.returncode == 0, result.stderr
    windows = [line.split()[2] for line in result.stdout.splitlines() if line.startswith("  ")]
    assert windows[:3] == ["hold"] * 3
    assert windows[-2:] == ["slip"] * 2


def test_the_figures_of_the_paper_that_need_no_sample(tmp_path):
    rng = np.random.default_rng(0)
    write_events(tmp_path / "r.h5", random_events(rng, 2000, labelled=False), (40, 30))
    result = example("paper_figures.py", tmp_path, "--only", 3, 8, "--real", tmp_path / "r.h5")
    assert result.returncode == 0, result.stderr
    for name in ("paper_3_flow_chart.jpg", "paper_8_real.jpg"):
        assert np.asarray(Image.open(tmp_path / name)).std() > 5


@pytest.fixture(scope="module")
def own(tmp_path_factory) -> tuple[Path, subprocess.CompletedProcess]:
    """Folder and outcome of the example in which everything is one's own."""
    folder = tmp_path_factory.mktemp("own") / "tour"
    return folder, example("own_everything.py", folder, timeout=900)


@pytest.mark.slow
def test_everything_of_ones_own(own):
    folder, result = own
    assert result.returncode == 0, result.stderr
    summary, training, alarm = result.stdout.splitlines()[-3:]
    assert " windows (" in summary and "validation balanced accuracy" in training and "slip begins at" in alarm
    windows = open_windows(folder / "windows.h5")
    assert {name.partition(":")[0] for name in windows.name} == {"tins", "boxes"}
    assert windows.settings.sensor == (320, 240) == (windows.settings.width, windows.settings.height)
    for name in ("scene.png", "live.png"):
        assert np.asarray(Image.open(folder / name)).std() > 5


@pytest.mark.slow
def test_the_tour_shows_what_it_says(own):
    """Its samples are those of the example, which are there already."""
    notebook = EXAMPLES / "tour.ipynb"
    cells = [cell for cell in json.loads(notebook.read_text())["cells"] if cell["cell_type"] == "code"]
    for cell, outputs in zip(cells, run(notebook, own[0].parent), strict=True):
        assert [_kinds(output) for output in outputs] == [_kinds(output) for output in cell["outputs"]]
    pictures = [output for cell in cells for output in cell["outputs"] if "image/png" in _kinds(output)]
    assert len(pictures) == 5


def _kinds(output: dict) -> set[str]:
    return set(output.get("data", {output["output_type"]: ""}))


def test_the_policy_of_the_tutorial_is_played(tmp_path):
    page = (EXAMPLES.parent / "docs/tutorials/own-policy.md").read_text()
    code = page.split("```python\n")[1].split("```")[0]
    assert len(code.splitlines()) <= 30
    (tmp_path / "my_policy.py").write_text(code)
    small = [f"--set={one}" for one in ("camera.width=86", "camera.height=65", "motion.kind=hold", "motion.hold_s=0.2")]
    command = [sys.executable, "-m", "evslip", "control", "--policy", "my_policy:Mine", "--count", "1", "--out", "held"]
    result = subprocess.run(
        [*command, *small, "--workers", "1"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stderr
    rows = [json.loads(line) for line in (tmp_path / "held/outcomes.jsonl").read_text().splitlines()]
    assert {row["controller"] for row in rows} == {"constant", "oracle", "my_policy:Mine"}
    assert all(row["mean_n"] > 0 for row in rows)


def test_the_ros2_node_answers_packets_of_a_bag(tmp_path):
    highlevel = pytest.importorskip("rosbags.highlevel")
    import evslip

    spec = importlib.util.spec_from_file_location("slip_node", EXAMPLES / "ros2_node" / "slip_node.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    events = random_events(np.random.default_rng(0), 4000, (346, 260), labelled=False)
    events = events.replace(t_us=events.t_us * 5)
    write_events(tmp_path / "a.mcap", events, (346, 260))
    answers: list[float] = []
    feed = module.SlipFeed("default", answers.append)
    with highlevel.AnyReader([tmp_path / "a.mcap"]) as reader:
        for connection, _, data in reader.messages():
            feed.take(reader.deserialize(data, connection.msgtype))
    expected = evslip.Detector("default", size=(346, 260), align="centre").push(events)
    assert answers[-1] == pytest.approx(expected, abs=1e-6)
    assert feed.refused == 0
    assert len((EXAMPLES / "ros2_node" / "slip_node.py").read_text().splitlines()) <= 70


def test_a_learned_grip_sees_on_a_robot_what_it_saw_when_it_learned(monkeypatch):
    pytest.importorskip("gymnasium")
    monkeypatch.syspath_prepend(EXAMPLES / "rl_grip")
    learned = importlib.import_module("learned_grip")
    env = learned.Seen(learned.environment())
    seen, _ = env.reset(options={"index": 1})
    episode = env.unwrapped.episode
    policy = learned.Learned()
    policy.reset(Setup(learned.SIZE, 1_000_000 // learned.RATE_HZ, episode.t_us, episode.senses.force_n, 0.5, 20.0))
    forces = []
    for _ in range(20):
        force_n = policy.step(env.unwrapped.events, episode.senses)
        np.testing.assert_array_equal(policy.features, seen)
        seen, *_ = env.step(np.array([policy.action], np.float32))
        forces.append((force_n, episode.senses.force_n))
    np.testing.assert_allclose(*np.transpose(forces), rtol=1e-5)
    assert np.ptp(forces) > 0
