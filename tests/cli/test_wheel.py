"""The package as a stranger gets it: a wheel, in an environment elsewhere with what it requires and no extras."""

import json
import shutil
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import numpy as np
import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import evslip
from evslip.codecs import write_events
from ros_bags import arrays
from sample_records import random_events

ROOT = Path(__file__).parents[2]
RUN = """
import contextlib, io, json, sys
from evslip.cli import main

found = []
for words in json.load(sys.stdin):
    sys.argv, said, code = ["evslip", *words], io.StringIO(), 0
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(said):
        try:
            main()
        except SystemExit as stop:
            code = stop.code
    found.append((words, code, said.getvalue()))
json.dump(found, sys.stdout)
"""
"""Several commands, one after another: Python starts once."""
RECORD = "data/samples/train/000/0000000.h5"
WITHOUT_EXTRAS = [
    "generate cheap.toml data --count 1 --workers 1",
    "warm-up cheap.toml",
    "status data",
    "verify data",
    "show cheap.toml --index 0",
    "doctor",
    f"info {RECORD}",
    f"convert {RECORD} converted.raw",
    "import converted.raw imported/a.h5 --labels labels.csv",
    "windows imported windows.h5 --no-balance --length-s 0.02 --hop-s 0.02",
    f"render {RECORD} --out pictures --phase hold --every 200",
    f"video {RECORD} --out film.mp4 --start-s 0 --end-s 0.05",
    "report data",
    "publish data published",
    "events clip.npz events.h5",
    "calibrate converted.raw noise.npz",
    "realism converted.raw converted.raw --no-classifier",
    "label-agreement labels.csv labels.csv",
    f"stream {RECORD} udp://127.0.0.1:7777 --speed 0",
]
EXTRAS = {
    "demo": "learn",
    "train windows.h5 model": "learn",
    "sweep windows.h5 sweep": "learn",
    "evaluate default data": "learn",
    f"detect --model default {RECORD}": "learn",
    "control --config cheap.toml --count 1 --out held": "learn",
    "export default out.nir": "learn",
    f"live {RECORD}": "learn",
    "view data --no-browser": "view",
    "play --no-browser": "view",
    f"label {RECORD} --no-browser": "view",
    "rerun data out.rrd": "rerun",
    f"render {RECORD} --out traced --renderer pathtrace": "photo",
    "generate cheap.toml traced --count 1 --set render.renderer=pathtrace": "photo",
    "generate cheap.toml other --count 1 --runner ray": "ray",
    "events clip.npz between.h5 --interpolate rife": "rife",
    "events clip.npz between.h5 --interpolate flow": "flow",
    "convert a.bag a.h5": "ros",
}


@pytest.fixture(scope="module")
def environment(tmp_path_factory) -> Path:
    """An empty environment with the wheel of this tree."""
    home = tmp_path_factory.mktemp("wheel")
    source, python = home / "source", home / "empty" / "bin" / "python"
    shutil.copytree(ROOT / "src", source / "src", ignore=shutil.ignore_patterns("__pycache__", "*.egg-info"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source)
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet"]
    subprocess.run([*pip, "wheel", "--no-deps", "--wheel-dir", home, source], check=True)
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", home / "empty"], check=True)
    (wheel,) = home.glob("*.whl")
    subprocess.run([*pip, "--python", python, "install", "--no-compile", "--no-deps", wheel], check=True)
    (packages,) = (home / "empty" / "lib").glob("python*/site-packages")
    link_required(packages)
    subprocess.run([*pip, "--python", python, "check"], check=True)
    carry_compiled(packages / "evslip")
    return python


def link_required(packages: Path) -> None:
    """Link into a folder of packages what those in it say that they require, from our own environment: installed, all
    of it would be unpacked and compiled once more."""
    waiting, known = list(metadata.distributions(path=[str(packages)])), set()
    while waiting:
        for requirement in map(Requirement, waiting.pop().requires or ()):
            name = canonicalize_name(requirement.name)
            if name in known or (requirement.marker is not None and not requirement.marker.evaluate({"extra": ""})):
                continue
            known.add(name)
            waiting.append(found := metadata.distribution(name))
            for top in {file.parts[0] for file in found.files or ()} - {"..", "__pycache__"}:
                if not (packages / top).exists():
                    (packages / top).symlink_to(str(found.locate_file(top)))


def carry_compiled(package: Path) -> None:
    """Copy what this machine has compiled of the same files, which takes minutes."""
    ours = Path(evslip.__file__).parent
    for path in ours.rglob("*.nb[ic]"):
        place = package / path.relative_to(ours)
        place.parent.mkdir(exist_ok=True)
        shutil.copy(path, place)


@pytest.fixture(scope="module")
def home(environment, tmp_path_factory) -> Path:
    """A folder outside the repository, with the files that the commands read."""
    home = tmp_path_factory.mktemp("home")
    shutil.copy(ROOT / "benchmarks" / "cheap.toml", home)
    (home / "labels.csv").write_text("0,0.02,hold\n0.02,0.05,slip\n")
    images = np.random.default_rng(0).integers(0, 255, (5, 30, 40), np.uint8)
    np.savez(home / "clip.npz", frames=images, t_us=np.arange(5) * 10_000)
    events = random_events(np.random.default_rng(0), 300, labelled=False)
    arrays(home / "a.bag", events, (40, 30), [])
    write_events(home / "a.csv", events, (40, 30))
    return home


@pytest.mark.slow
def test_the_wheel_has_every_file_that_is_no_module(environment):
    ours = Path(evslip.__file__).parent
    (theirs,) = (environment.parents[1] / "lib").glob("python*/site-packages/evslip")
    files = [path.relative_to(ours) for path in ours.rglob("*") if path.is_file() and path.suffix != ".py"]
    files = [path for path in files if "__pycache__" not in path.parts]
    assert len(files) > 20
    assert [str(path) for path in files if not (theirs / path).is_file()] == []


def run(python: Path, home: Path, commands: list[str]) -> list[tuple[list[str], int, str]]:
    """Words, exit code and stderr of each command, in the environment."""
    words = json.dumps([command.split() for command in commands])
    done = subprocess.run([python, "-c", RUN], cwd=home, input=words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.slow
def test_every_verb_works_or_names_the_extra_that_it_needs(environment, home):
    said = subprocess.run(
        [environment.with_name("evslip"), "--version"], cwd=home, capture_output=True, text=True, check=True
    )
    assert said.stdout == f"evslip {evslip.__version__}\n"
    for words, code, said in run(environment, home, WITHOUT_EXTRAS):
        assert (code, said) == (0, ""), words
    for (words, code, said), extra in zip(run(environment, home, list(EXTRAS)), EXTRAS.values(), strict=True):
        assert code == 2 and f"pip install 'evslip[{extra}]'" in said and said.count("\n") == 1, (words, code, said)


def test_every_verb_is_tried():
    from evslip.cli import VERBS

    assert {command.split()[0] for command in (*WITHOUT_EXTRAS, *EXTRAS)} == set(VERBS)
