"""Whether samples of each kind of slip do what its name says.

python benchmarks/slip_kinds.py [--preset complex] [--count 16] [--kinds tilt drop] [--split test] [--set KEY=VALUE]
"""

import argparse
import sys
from collections import Counter
from pathlib import Path

import numpy as np

import evslip
from evslip.config.loading import parse_override
from evslip.config.sections.slip import SLIP_KINDS
from evslip.physics.truth import Truth
from evslip.utils.errors import EvslipError
from evslip.utils.seeds import SPLITS
from evslip.windows.cutting import label_of, movements
from evslip.windows.label import Label
from evslip.windows.window_set import WindowSettings

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))
from named_slips import shows  # pyright: ignore[reportMissingImports]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--preset", default="complex")
    parser.add_argument("--count", type=int, default=16)
    parser.add_argument("--kinds", nargs="+", default=list(SLIP_KINDS[1:]), choices=SLIP_KINDS)
    parser.add_argument("--split", default="train", choices=SPLITS)
    parser.add_argument("--set", nargs="*", default=[], metavar="KEY=VALUE")
    options = parser.parse_args()
    given = dict(map(parse_override, options.set))
    print(f"{options.preset}, {options.count} samples of each kind")
    print(
        "| kind | as its name says | x onset | turn, deg | slide, mm | slip begins in | windows hold / between / slip |"
    )
    print("|---|---|---|---|---|---|---|")
    for kind in options.kinds:
        config = evslip.load_config(options.preset, {**given, "slip.kind": kind})
        print(_row(config, kind, options.count, options.split), flush=True)


def _row(config: evslip.Config, kind: str, count: int, split: str) -> str:
    truths, multiples, notes = [], [], []
    for index in range(count):
        params = evslip.draw(config, index, split)
        try:
            truth = evslip.measure(evslip.simulate(params))
        except EvslipError as error:
            notes.append(f"{index}: {error}")
            continue
        truths.append(truth)
        multiples.append(params.slip.multiple or np.nan)
        if not shows(kind, truth):
            notes.append(f"{index}: {truth.episodes}")
    right = sum(shows(kind, truth) for truth in truths)
    turns, slides = (_range([f(truth) for truth in truths]) for f in (_turn, _slide))
    phases = Counter(truth.episodes[0].phase for truth in truths if truth.episodes)
    labels = np.concatenate([_labels(truth) for truth in truths])
    order = Label.HOLD, Label.UNCERTAIN, Label.SLIP
    shares = " / ".join(f"{100 * np.mean(labels == label):.0f} %" for label in order)
    begins = ", ".join(f"{phase} {number}" for phase, number in phases.items()) or "-"
    row = f"| {kind} | {right} of {count} | {_range(multiples)} | {turns} | {slides} | {begins} | {shares} |"
    return "\n".join([row, *notes])


def _turn(truth: Truth) -> float:
    return float(np.ptp(truth.spin_deg[truth.held]))


def _slide(truth: Truth) -> float:
    held = truth.slide_m[truth.held]
    return 1e3 * float(np.linalg.norm(held - held[0], axis=1).max())


def _labels(truth: Truth) -> np.ndarray:
    settings = WindowSettings()
    return np.array([label_of(movement, settings) for movement in movements(truth, settings)])


def _range(values: list[float]) -> str:
    return f"{min(values):.3g}...{max(values):.3g}" if values else "-"


if __name__ == "__main__":
    main()
