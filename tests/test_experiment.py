"""experiments/reproduce.py at its smallest: every cell of its tables comes from what the product wrote."""

import importlib
import json
import math
import re
import statistics
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from command_line import evslip
from evslip.config.loading import load_config, parse_override
from evslip.config.params import Params
from evslip.config.sample import leaves
from evslip.draws.draw import draw
from evslip.learn import build_model
from evslip.learn.checkpoint import Description, save_model
from evslip.learn.evaluation.alarms import Alarms
from evslip.learn.evaluation.evaluation import evaluate_model
from evslip.learn.evaluation.evaluation_data import EvaluationData
from evslip.windows.cutting import windows_of
from evslip.windows.window_set import WindowSettings
from slip_records import slip_records

SCRIPT = Path(__file__).resolve().parents[1] / "experiments" / "reproduce.py"
KEYS = (
    "camera.width=16", "camera.height=16", "render.max_motion_px=16.0", "render.min_rate_hz=10.0",
    "robot.kind=cartesian", "motion.kind=hold", "motion.duration_s=3.0", "motion.hold_s=0.4",
    'slip.kind=["hold", "rotation"]', "slip_fraction=0.5",
)  # fmt: skip
TINY = (
    "--small", "--simple", 12, "--complex-train", 8, "--complex-test", 4, "--world", 3, "--ablation-train", 8,
    "--ablation-test", 4, "--finals", "voxelnet", "event_rate", "--trials", 1, "--resamples", 20, "--jobs", 2,
    "--workers", 1, "--window-hop-s", 0.01, "--training", "epochs=1", "--keys", *KEYS,
)  # fmt: skip


def command(out: Path, *more: object) -> list[str]:
    return [sys.executable, str(SCRIPT), "--out", str(out), *map(str, TINY), *map(str, more)]


def reproduce(out: Path, *more: object) -> subprocess.CompletedProcess:
    return subprocess.run(command(out, *more), capture_output=True, text=True, check=False)


def reproduce_here(monkeypatch: pytest.MonkeyPatch, out: Path) -> int:
    """Its exit code within the tests' own process: thirty processes would import PyTorch thirty times."""

    def run_command(words: Sequence[str], log: Path) -> int:
        done = evslip(*words)
        log.write_text(done.stdout + done.stderr)
        return done.returncode

    monkeypatch.syspath_prepend(SCRIPT.parent)
    monkeypatch.setattr(importlib.import_module("steps"), "run_command", run_command)
    monkeypatch.setattr(sys, "argv", command(out, "--jobs", 1)[1:])
    return importlib.import_module("reproduce").main()


def rows(text: str, under: str) -> dict[str, list[str]]:
    """The lines of the first table whose head contains a word, by their first cell."""
    tables = [block for block in re.split(r"\n\n+", text) if block.startswith("|")]
    block = next(block for block in tables if under in block.splitlines()[0])
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in block.splitlines()[2:]]
    return {line[0]: line[1:] for line in cells}


def scores(folder: Path) -> dict:
    return json.loads((folder / "evaluation.json").read_text())["models"][0]


def validation(folder: Path) -> str:
    """Accuracy of the epoch that was kept, %."""
    best = json.loads((folder / "model.json").read_text())["training"]["best_epoch"]
    return f"{100 * json.loads((folder / 'history.json').read_text())[best - 1]['val_accuracy']:.1f}"


def test_a_cell_of_several_seeds_has_mean_and_range(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(SCRIPT.parent)
    spread = importlib.import_module("readings").spread
    assert spread([0.81, 0.9, 0.84], 1, 100) == "85.0 (81.0–90.0)"
    assert spread([0.81], 1, 100) == "81.0"
    assert spread([0.02, math.inf], 0, 1000) == "20, never"
    assert spread([math.inf, math.inf], 0, 1000) == "never"
    assert spread([math.nan, 0.5]) == "–"
    assert spread([]) == "not run"


def drawn_with(keys: dict[str, str]) -> Params:
    """A sample of the preset complex with these keys."""
    changes = dict(parse_override(f"{key}={value}") for key, value in keys.items())
    return draw(load_config("complex", changes), 1, "test")


def test_every_strength_of_a_nuisance_can_be_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(SCRIPT.parent)
    for own in importlib.import_module("worlds").NUISANCES.values():
        assert own.middle in own.strengths and len(set(own.strengths)) == len(own.strengths) >= 4
        plain = leaves(drawn_with(own.fixed))
        drawn = [drawn_with(own.keys(strength)) for strength in own.strengths]
        for params in drawn:
            assert {key for key, value in leaves(params).items() if value != plain[key]} <= set(own.varied), own.title
        assert len({params.model_dump_json() for params in drawn}) == len(drawn)


def test_the_curves_of_nuisances_are_means_over_seeds(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.syspath_prepend(SCRIPT.parents[1] / "benchmarks")
    curves = importlib.import_module("nuisances")
    assert curves.poisson_interval(5, 1.0) == pytest.approx((1.623, 11.668), abs=1e-3)  # Garwood's table
    assert curves.poisson_interval(0, 2.0) == pytest.approx((0.0, 3.689 / 2), abs=1e-3)
    network = build_model("event_rate")
    network.fit(windows_of(slip_records(4)))
    save_model(tmp_path / "rate", network, Description("event_rate", 0.5, WindowSettings(), {}))
    cut = windows_of(slip_records(4), WindowSettings())
    one = evaluate_model(tmp_path / "rate", EvaluationData("made up", cut), resamples=20)
    alarms = Alarms(0.5, 2, 4.0, 0, 0.01, 3, 3, np.array([0.01, 0.02, 0.03]), np.zeros(3), np.zeros(3))
    seeds = [replace(one, own=replace(alarms, false_alarms=count)) for count in (2, 6)]
    points = {"object": [curves.point("object", strength, strength == 0.4, "new", seeds) for strength in (0.0, 0.4)]}
    middle = points["object"][1]
    assert (middle.seeds, middle.false_per_min, middle.detection_rate) == (2, 1.0, 1.0)
    assert middle.balanced_accuracy == pytest.approx(100 * one.scores.balanced_accuracy)
    curves.write(tmp_path, points, {"count": 2})
    assert "| object trembling in its pads, 30 Hz | **0.4 mm rms** | " in (tmp_path / "nuisances.md").read_text()
    assert json.loads((tmp_path / "nuisances.json").read_text())["points"][1]["is_middle"]
    with Image.open(tmp_path / "nuisances.png") as picture:
        assert picture.size[0] > 400


TOGETHER = """
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
import steps
steps.IMPORTED = ("evslip.cli",)
with ThreadPoolExecutor(8) as pool:
    logs = [Path(sys.argv[1]) / f"{number}.log" for number in range(100)]
    print(sorted(pool.map(lambda log: steps.run_command(("--version",), log), logs)))
"""


def test_each_of_the_commands_that_run_together_has_its_own_exit_code(tmp_path: Path) -> None:
    program = [sys.executable, "-c", TOGETHER, str(tmp_path)]
    done = subprocess.run(program, cwd=SCRIPT.parent, capture_output=True, text=True, check=False)
    assert json.loads(done.stdout) == [0] * 100, done.stderr
    assert {log.read_text() for log in tmp_path.iterdir()} == {evslip("--version").stdout}


@pytest.mark.slow
def test_every_cell_is_what_the_product_measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "all"
    assert reproduce_here(monkeypatch, out) == 0
    text = "".join((out / page).read_text() for page in ("results.md", "results-tables.md"))
    table2 = rows(text, "Simple val, paper")
    others = rows(text, "| Simple Set |")
    assert (list(table2), list(others)) == (["`mlp`", "`snn`", "`cnn3d`"], ["`voxelnet`", "`event_rate`"])
    assert [table2["`mlp`"][place] for place in (0, 3, 6)] == ["98", "72", "69"]
    for network, cells in (("mlp", [table2["`mlp`"][2], table2["`mlp`"][5]]), ("event_rate", others["`event_rate`"])):
        assert cells == [validation(out / f"models/{name}/{network}-0") for name in ("simple", "complex")]
        test = scores(out / f"evaluations/test/{network}-0")
        accuracy = f"{100 * test['scores']['balanced_accuracy']:.1f}"
        assert rows(text, "AUROC ≥")[f"`{network}`"][0] == accuracy
        assert network == "event_rate" or table2[f"`{network}`"][7] == accuracy
        assert rows(text, "AUROC ≥")[f"`{network}`"][1] == f"{test['scores']['auroc']:.4f}"
        assert rows(text, "AUPRC")[f"`{network}`"][1] == f"{test['scores']['f1']:.3f}"
    assert table2["`mlp`"][1] == validation(out / "models/simple-paper/mlp-0")
    assert table2["`mlp`"][4] == validation(out / "models/complex-paper/mlp-0")
    swept = rows(text, "best run")["simple/mlp"]
    found, again = (validation(out / name) for name in ("sweeps/simple/mlp/trials/0000", "models/simple-tuned/mlp-0"))
    assert swept[:5] == ["1", found, again, table2["`mlp`"][2], "98"]
    world = "camera in front of the hand"
    fronts = [scores(out / f"evaluations/worlds/front/{name}-0")["scores"] for name in ("voxelnet", "event_rate")]
    balanced = [f"{100 * front['balanced_accuracy']:.1f}" for front in fronts]
    assert rows(text, "| windows, trajectories |")[world][1:] == balanced
    assert rows(text, "world: AUROC")[world] == [f"{front['auroc']:.3f}" for front in fronts]
    threshold = scores(out / "evaluations/ablation/threshold/event_rate-0")["scores"]
    fixed = f"{100 * threshold['balanced_accuracy']:.1f}; {threshold['auroc']:.3f}"
    assert rows(text, "fixed")["the contrast threshold"][-1] == fixed
    entries = [
        json.loads(line) for path in out.glob("data/simple/journal/*/*") for line in path.read_text().splitlines()
    ]
    simple = rows(text, "million events a sample")["Simple Set"]
    assert simple[0] == str(len(entries)) == "12"
    assert simple[-1] == f"{statistics.mean(entry['events'] for entry in entries) / 1e6:.2f}"
    assert "This run is smaller than the paper's experiment" in text
    assert (out / "default" / "README.md").is_file() and (out / "default" / "model.safetensors").is_file()
    resumes_and_notices(out)


def resumes_and_notices(out: Path) -> None:
    """Nothing is done twice; a gap and a changed command are told, and what is missing is made."""
    again = reproduce(out)
    assert again.returncode == 0
    assert "$ evslip" not in again.stdout
    changed = reproduce(out, "--training", "epochs=2", "--stages", "train")
    assert changed.returncode == 1
    assert "now it would be `evslip train" in changed.stderr and "Traceback" not in changed.stderr
    (out / "evaluations/test/mlp-0/evaluation.json").unlink()
    gap = reproduce(out, "--stages", "tables")
    assert gap.returncode == 1
    assert "evaluate test/mlp-0" in gap.stdout
    filled = reproduce(out, "--stages", "test", "tables")
    assert filled.returncode == 0, filled.stdout + filled.stderr
    assert filled.stdout.count("$ evslip") == filled.stdout.count("$ evslip evaluate") == 1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--keys", "camera.width"), "expected KEY=VALUE"),
        (("--trials", "-1"), "trials: -1 is out of range, expected 0 or more"),
        (("--jobs", "0"), "jobs: 0 is out of range, expected 1 or more"),
        (("--seeds", "0", "-1"), "seeds: -1 is out of range"),
        (("--real", "nowhere"), "nowhere is no folder"),
        (("--stages", "ship"), "run the stage"),
        (("--stages", "ship", "--ship-model", "mlp"), "expected NETWORK-SEED"),
        (("--stages", "train", "--training", "epochs"), "expected OPTION=VALUE"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(
    arguments: tuple[str, ...], words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    monkeypatch.syspath_prepend(SCRIPT.parent)
    monkeypatch.setattr(sys, "argv", command(tmp_path / "none", *arguments)[1:])
    with pytest.raises(SystemExit) as stop:
        importlib.import_module("reproduce").main()
    assert isinstance(stop.value.code, str)  # which Python prints, and exits with 1
    assert words in stop.value.code
    assert len(stop.value.code.splitlines()) == 1
    assert not capsys.readouterr().err
