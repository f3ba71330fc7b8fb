"""Whether a change of the code changed what it makes: records, answers of the shipped detector, public names, help.

python benchmarks/same_bytes.py keep before.json     before the change
python benchmarks/same_bytes.py compare before.json  after it; exit code 1 if records, answers or names differ

Thirteen small records are made: both presets, each shape, mounts, two cameras, each motion, other sensors, a
path-traced one (left out where mitsuba is not installed). Sums are those of one machine and one set of installed
versions. Changes of help texts are printed and do not count as differences.
"""

import argparse
import difflib
import hashlib
import inspect
import json
import os
import re
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

import evslip
from evslip.cli import VERBS
from evslip.learn.shipped import NAMES

TINY = {"camera.width": 96, "camera.height": 72, "motion.duration_s": 6.0}
QUICK = {"motion.duration_s": 6.0}
RECORDS: dict[str, tuple[str, dict[str, Any]]] = {
    "simple": ("simple", QUICK),
    "complex": ("complex", QUICK | {"slip.kind": "tilt"}),
    "cylinder, slips by rotation": ("complex", TINY | {"object.shape": "cylinder", "slip.kind": "rotation"}),
    "mesh": ("complex", TINY | {"object.shape": "mesh", "object.mesh": "cup.stl", "seed": 3}),
    "two cameras": ("complex", TINY | {"camera.left": {"mount": "finger"}, "camera.right": {"fov_deg": 60.0}}),
    "front, shake": ("complex", TINY | {"camera.mount": "front", "motion.kind": "shake"}),
    "custom mount, lens": (
        "complex",
        TINY | {"camera.mount": "custom", "camera.y_m": 0.25, "camera.z_m": 0.1, "camera.k1": -0.2, "seed": 1},
    ),
    "rotate, no noise": ("simple", TINY | {"motion.kind": "rotate", "sensor.preset": "clean"}),
    "hold, noisy": ("simple", TINY | {"motion.kind": "hold", "sensor.preset": "noisy"}),
    "waypoints, cartesian": (
        "complex",
        TINY
        | {"motion.kind": "waypoints", "motion.waypoints": [{"y_m": -0.1, "tilt_deg": 20.0}, {"y_m": -0.15}]}
        | {"robot.kind": "cartesian"},
    ),
    "absolute exposure": ("complex", TINY | {"camera.exposure": "absolute", "sensor.theta": 0.3, "slip.kind": "lift"}),
    "demo": ("demo", TINY),
    "path-traced": (
        "simple",
        {"camera.width": 32, "camera.height": 24, "motion.duration_s": 6.0, "render.renderer": "pathtrace"}
        | {"render.spp": 1, "render.max_motion_px": 4.0, "render.key_motion_px": 16.0},
    ),
}
ANSWERED = ("simple", "complex")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("verb", choices=("keep", "compare"))
    parser.add_argument("file", type=Path)
    options = parser.parse_args()
    if options.verb == "keep":
        options.file.write_text(json.dumps(state(), indent=1) + "\n", encoding="utf-8")
        return 0
    before, after = json.loads(options.file.read_text(encoding="utf-8")), state()
    return print_differences(before, after)


def state() -> dict[str, dict[str, str]]:
    """Everything that is compared, by kind and name."""
    with tempfile.TemporaryDirectory() as folder:
        made = {name: record(name, Path(folder)) for name in RECORDS if name != "path-traced" or find_spec("mitsuba")}
        answers = {name: answered(made[name]) for name in ANSWERED}
        sums = {name: hashlib.sha256(path.read_bytes()).hexdigest() for name, path in made.items()}
    names = {name: kind_of(getattr(evslip, name)) for name in evslip.__all__}
    helps = {verb: help_of(verb) for verb in ("", *VERBS)}
    return {"records": sums, "answers": answers, "names": names, "help": helps}


def record(name: str, folder: Path) -> Path:
    """Make a record; its file."""
    preset, changes = RECORDS[name]
    root = folder / str(list(RECORDS).index(name))
    root.mkdir()
    os.chdir(root)
    if changes.get("object.shape") == "mesh":
        trimesh.creation.revolve(np.array([[0, 0], [0.02, 0], [0.03, 0.08], [0, 0.08]]), sections=24).export("cup.stl")
    evslip.generate(evslip.load_config(preset, changes), "out", 1, workers=1)
    os.chdir(folder)
    (path,) = (root / "out").rglob("*0000000.h5")
    kind = evslip.open_dataset(root / "out").read(0, events=False).kind
    print(f"{name}: {path.stat().st_size:,} bytes, {kind}", file=sys.stderr, flush=True)
    return path


def answered(path: Path) -> str:
    """Sum of the slip probabilities of the detector of `complex`, rounded to five digits: threads may differ."""
    taken = evslip.read_events(path)
    model = next(name for name in ("default-complex", "default") if name in NAMES)
    answers = evslip.learn.detect(model, taken, (346, 260), hop_s=0.02).p_slip
    return hashlib.sha256(np.round(answers, 5).tobytes()).hexdigest()


def kind_of(value: Any) -> str:
    if inspect.isclass(value):
        return f"class {inspect.signature(value)}" if value is evslip.EventCamera else "class"
    if not callable(value):
        return type(value).__name__
    return re.sub(r" at 0x[0-9a-f]+", "", f"function {inspect.signature(value)}")  # where a default lies in memory


def without_modules(text: str) -> str:
    """A signature without the places of its types, which may move."""
    return re.sub(r"\bevslip\.(\w+\.)*", "", text)


def help_of(verb: str) -> str:
    command = [sys.executable, "-m", "evslip", *([verb] if verb else []), "--help"]
    environment = os.environ | {"COLUMNS": "140", "NO_COLOR": "1"}
    return subprocess.run(command, check=True, capture_output=True, text=True, env=environment).stdout


def print_differences(before: dict[str, dict[str, str]], after: dict[str, dict[str, str]]) -> int:
    differ = 0
    for kind in before:
        for name in before[kind] | after[kind]:
            old, new = before[kind].get(name, "absent"), after[kind].get(name, "absent")
            if old == new or (kind == "names" and without_modules(old) == without_modules(new)):
                continue
            differ += kind != "help"
            print(f"{kind}: {name or 'evslip'}")
            print("\n".join(difflib.unified_diff(old.splitlines(), new.splitlines(), lineterm="", n=0)))
        print(f"{kind}: {len(after[kind])} compared")
    print(f"{differ} differences beside the help texts")
    return int(differ > 0)


if __name__ == "__main__":
    sys.exit(main())
