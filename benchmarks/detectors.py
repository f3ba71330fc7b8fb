"""Train and test every network over several seeds: python benchmarks/detectors.py TRAIN.h5 TEST.h5 OUT

Prints the table of docs/explanation/detectors.md: mean and range over the seeds on the test windows. Both files
are made by `evslip windows`, from splits that share no trajectory; without TEST the figures are those of the
validation trajectories, on which epoch and threshold were chosen. A network and seed whose model is in OUT is not
trained again, and an unfinished one goes on, so several processes may share the work by --networks or --seeds.
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np

from evslip.learn import NETWORKS, TrainSettings, build_model, evaluate, train
from evslip.windows.window_set import Windows, open_windows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("train", type=Path)
    parser.add_argument("test", type=Path, nargs="?")
    parser.add_argument("out", type=Path)
    parser.add_argument("--networks", nargs="+", default=list(NETWORKS), choices=list(NETWORKS))
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2])
    parser.add_argument("--epochs", type=int, help="most passes; default: what suits each network")
    parser.add_argument("--protocol", default="trajectory", choices=["trajectory", "paper"])
    options = parser.parse_args()
    windows, test = open_windows(options.train), open_windows(options.test) if options.test else None
    where = f"{len(test)} test windows" if test else "validation windows"
    print(f"| network | parameters | accuracy, % of {where} | AUROC | training, min |\n|---|---|---|---|---|")
    for name in options.networks:
        rows = [one(name, seed, windows, test, options) for seed in options.seeds]
        accuracy, area, minutes = np.array(rows).T
        number = sum(p.numel() for p in build_model(name).parameters())
        parameters = f"{number:,}" if number else "-"  # the others are found without gradients
        spread = f"{100 * accuracy.mean():.1f} ({100 * accuracy.min():.1f}-{100 * accuracy.max():.1f})"
        print(f"| `{name}` | {parameters} | {spread} | {area.mean():.3f} | {minutes.mean():.1f} |", flush=True)


def one(
    name: str, seed: int, windows: Windows, test: Windows | None, options: argparse.Namespace
) -> tuple[float, float, float]:
    """Balanced accuracy, AUROC and minutes of training of one network and seed."""
    folder = options.out / f"{name}-{seed}"
    spent = folder / "minutes.json"
    if not spent.exists():
        start = time.perf_counter()
        settings = TrainSettings.of(name, seed=seed, epochs=options.epochs, protocol=options.protocol)
        train(windows, folder, settings)
        spent.write_text(json.dumps((time.perf_counter() - start) / 60))
    minutes = json.loads(spent.read_text())
    facts = json.loads((folder / "model.json").read_text())["training"]
    if test is None:
        return facts["val_accuracy"], facts["val_auroc"], minutes
    metrics = evaluate(folder, test)
    return metrics.balanced_accuracy, metrics.auroc, minutes


if __name__ == "__main__":
    main()
