"""Which part of the package may use which heavy library, so that each half stands alone."""

import importlib
import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import grimp
import pytest

import evslip

PACKAGE = Path(evslip.__file__).parent
USERS = {
    "torch": ("learn", "codecs.clips.rife", "cli.doctor"),
    "cv2": ("codecs.clips.flow",),
    "mujoco": ("physics",),
    "pydantic": ("config", "view.pictures.replay"),
    "pydantic_core": ("config",),
    "numba": ("utils.jit", "utils.refcount", "events.pixels", "rendering", "learn"),
    "mitsuba": ("rendering.pathtrace",),
    "gymnasium": ("control.environment", "control.observations", "control.registration"),
    "matplotlib": ("view", "control.picture_window"),
    "plotly": ("view",),
    "dv_processing": ("exchange.live",),
    "zenoh": ("exchange.live",),
    "neuromorphic_drivers": ("exchange.live",),
    "ray": ("generation.runners",),
    "optuna": ("learn.search",),
    "tyro": ("cli",),
    "starlette": ("view.explorer", "view.live", "view.play", "view.web"),
    "rerun": ("view",),
    "pyarrow": ("exchange.publishing.lerobot",),
    "trimesh": ("scene.shapes", "rendering.geometry", "physics.robots.hulls"),
}
ROOMS, FILES = 16, 14


@pytest.fixture(scope="module")
def imports() -> grimp.ImportGraph:
    return grimp.build_graph("evslip", include_external_packages=True, cache_dir=None)


@pytest.mark.parametrize("library", USERS)
def test_a_library_is_used_by_its_rooms_alone(imports, library):
    for module in imports.find_modules_that_directly_import(library):
        inside = module.removeprefix("evslip.")
        assert any(f"{inside}.".startswith(f"{user}.") for user in USERS[library]), f"{module} imports {library}"


def test_the_event_pixel_needs_nothing_but_numpy_and_numba(imports):
    chain = {
        module for module in imports.modules if re.match(r"evslip\.events\.(camera|pixels|sensor|v2e|presets)", module)
    }
    external = {name for module in chain for name in imports.find_modules_directly_imported_by(module)}
    third_party = {name for name in external if imports.is_module_squashed(name)} - set(_standard_library())
    assert third_party <= {"numpy", "numba"}


def test_the_two_halves_meet_at_the_file_format_alone(imports):
    """Generation never imports torch, learning never mujoco, at any distance, but through modules that are lazy."""
    for half, library in (("evslip.generation", "torch"), ("evslip.learn", "mujoco")):
        assert imports.find_shortest_chain(half, library, as_packages=True) is None


def test_hints_to_install_work_away_from_the_repository():
    extras = tomllib.loads((PACKAGE.parents[1] / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    named: set[str] = set()
    for path in PACKAGE.rglob("*.py"):
        text = path.read_text()
        assert not re.search(r"constraints\.txt|pip install (-|[^'\"]*\[)", text), (
            f"{path}: a hint for this repository alone"
        )
        named.update(*(match.split(",") for match in re.findall(r"'evslip\[([\w,]+)\]'", text)))
    assert {"learn", "ray", "photo", "ros"} <= named <= set(extras)


@pytest.mark.parametrize("package", ["evslip", "evslip.events", "evslip.learn", "evslip.learn.networks"])
def test_lazy_packages_list_their_names(package):
    module = importlib.import_module(package)
    shown = {name for name in dir(module) if not name.startswith("_")}
    assert shown == set(module.__all__)
    assert all(getattr(module, name) is not None for name in shown)


WITHOUT_TORCH = """
import json, sys
sys.modules["torch"] = None
import pydoc, rlcompleter, types
import evslip

completer, found = rlcompleter.Completer({"evslip": evslip}), []
for text in ("evslip.", "evslip.learn."):
    completer.complete(text, 0)
    found.append([match.removeprefix(text).split("(")[0] for match in completer.matches])
assert "Detector" in pydoc.render_doc(evslip)

from evslip import Detector
said = []
for use in (lambda: Detector("default"), lambda: isinstance(1, Detector), lambda: evslip.learn.TrainSettings.of("mlp"),
            lambda: evslip.learn.NETWORKS["mlp"], lambda: types.new_class("Mine", (evslip.learn.WindowDataset,))):
    try:
        use()
    except evslip.EvslipError as error:
        said.append(str(error))
json.dump([*found, said], sys.stdout)
"""


def test_names_complete_and_explain_themselves_without_the_package_that_they_need():
    command = [sys.executable, "-c", WITHOUT_TORCH]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    package, learn, said = json.loads(done.stdout)
    assert set(package) == set(evslip.__all__)
    assert set(learn) == set(evslip.learn.__all__)
    assert said == ["detectors need PyTorch; pip install 'evslip[learn]'"] * 5


def test_there_are_few_rooms_and_few_files_in_each():
    rooms = [path for path in PACKAGE.iterdir() if (path / "__init__.py").exists()]
    assert len(rooms) <= ROOMS
    for folder in {path.parent for path in PACKAGE.rglob("*.py")}:
        files = [path.name for path in folder.glob("*.py") if path.name != "__init__.py"]
        assert len(files) <= FILES, f"{folder}: {len(files)} files"


@pytest.mark.parametrize("room", sorted(path.parent.name for path in PACKAGE.glob("*/__init__.py")))
def test_every_room_says_what_happens_in_it(room):
    text = (PACKAGE / room / "__init__.py").read_text()
    about = re.match(r'"""(.*?)"""', text, re.DOTALL)
    assert about is not None
    lines = [line for line in about[1].splitlines() if line.strip()]
    assert len(lines) >= 3
    assert re.search(r"^Begin with ", about[1], re.MULTILINE)


def _standard_library() -> frozenset[str]:
    return sys.stdlib_module_names


def test_no_two_scripts_that_tests_import_have_one_name():
    """One process imports from all of these folders: the first module of a name would be taken for the others."""
    root = Path(__file__).parents[1]
    names = [
        file.stem for folder in ("benchmarks", "experiments", "tests/helpers") for file in (root / folder).glob("*.py")
    ]
    assert len(names) == len(set(names)), sorted(name for name in set(names) if names.count(name) > 1)
