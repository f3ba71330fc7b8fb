"""Every measured figure of the documentation again.

python benchmarks/figures.py [OUT] [--only TABLE ...] [--recordings FOLDER]

A table is what one command prints. OUT/TABLE.md has it, with the command, the machine, the commit and the time that it
took; OUT/TABLE.log has what the command said else. Run it again after a stop: what this commit has printed is not done
again. A table that needs recordings of real sensors is left out without --recordings, one that needs an NVIDIA GPU
without one, and said so. Exit code 1: a command failed. `--list` prints the commands. All of it takes many hours; the
experiment, `make reproduce`, is apart.
"""

import argparse
import re
import shlex
import shutil
import subprocess
import sys
import time
from pathlib import Path

from evslip.utils import atomic

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "experiments"))
from machine import describe, facts  # pyright: ignore[reportMissingImports]

ROOT = Path(__file__).resolve().parents[1]
RECORDINGS, OUT = "RECORDINGS", "OUT"
"""In a command: the folder of real recordings, and a folder that it may fill."""

TABLES = {
    "first-run": "first_run.py",
    "generate": "generate.py",
    "draw-sequence": "draw_sequence.py",
    "render-scaling": "render_scaling.py",
    "render": "render.py simple 8",
    "render-outputs": "render.py simple 1 outputs",
    "shadow-events": "shadow_events.py",
    "held-events": "held_events.py",
    "smoothness": "smoothness.py",
    "fidelity": "fidelity.py",
    "flicker": "flicker.py",
    "denoise": "denoise.py",
    "event-fidelity": "event_fidelity.py",
    "physics": "physics.py",
    "grip-varies": "physics.py --grip-varies",
    "robots": "physics.py --robot all --only onset motion creep",
    "robot-frames": "robot_frames.py",
    "slip-kinds": "slip_kinds.py",
    "shapes": "shapes.py",
    "textures": "textures.py",
    "events": "events.py",
    "readout": "readout.py load",
    "readout-clock": "readout.py recording RECORDINGS/dvxplorer.aedat4",
    "readout-rows": "readout.py rows RECORDINGS/evt2.raw",
    "realism": "realism.py RECORDINGS/davis346.aedat4 --classifier",
    "interpolation": "interpolation.py",
    "calibrate": "calibrate.py",
    "codecs": "codecs.py",
    "learn": "learn.py --threads 1",
    "nuisances": "nuisances.py OUT --model default --model default-complex --model default-wild",
    "real-answers": "real_answers.py RECORDINGS --model default --model default-complex --model default-wild",
    "stream": "stream.py",
    "live": "live.py",
    "control": "control.py",
    "limits": "control.py --limits OUT",
    "load-cone": "load_cone.py --count 40",
    "view": "view.py",
    "gpu": "gpu.py",
}
"""Scripts of this folder, with their arguments."""


def done(page: Path, commit: str) -> bool:
    """Whether a table is of this commit."""
    return page.is_file() and f"commit {commit} " in page.read_text(encoding="utf-8").partition("\n\n")[0]


def run(name: str, out: Path, recordings: Path | None, known: dict) -> bool:
    """Print one table into its page; False if the command failed."""
    places = {OUT: str(out / name), RECORDINGS: str(recordings)}
    filled = re.sub("RECORDINGS|OUT", lambda found: shlex.quote(places[found[0]]), TABLES[name])
    script, *words = shlex.split(filled)
    command = [sys.executable, f"benchmarks/{script}", *words]
    begun = time.monotonic()
    with (out / f"{name}.log").open("w", encoding="utf-8") as log:
        ended = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=log, text=True, check=False)
    if ended.returncode:
        return False
    head = f"`python benchmarks/{TABLES[name]}`: {describe([known])[0]}; {time.monotonic() - begun:.0f} s."
    atomic.write_text(out / f"{name}.md", f"{head}\n\n{ended.stdout}")
    return True


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path, nargs="?", default=ROOT / "figures")
    parser.add_argument("--only", nargs="+", choices=list(TABLES), default=list(TABLES), metavar="TABLE")
    parser.add_argument("--recordings", type=Path, help="folder of real recordings")
    parser.add_argument("--list", action="store_true", help="print what would run")
    asked = parser.parse_args()
    if asked.list:
        print("\n".join(f"{name}: python benchmarks/{TABLES[name]}" for name in asked.only))
        return 0
    out, known, failed = asked.out.resolve(), facts(), 0
    out.mkdir(parents=True, exist_ok=True)
    for name in asked.only:
        if done(out / f"{name}.md", known["commit"]):
            print(f"{name}: there")
        elif RECORDINGS in TABLES[name] and asked.recordings is None:
            print(f"{name}: left out; it needs --recordings FOLDER")
        elif name == "gpu" and shutil.which("nvidia-smi") is None:
            print(f"{name}: left out; it needs an NVIDIA GPU")
        else:
            print(f"{name}: python benchmarks/{TABLES[name]}", flush=True)
            if not run(name, out, asked.recordings and asked.recordings.resolve(), known):
                failed += 1
                print(f"{name}: failed; see {out / name}.log")
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
