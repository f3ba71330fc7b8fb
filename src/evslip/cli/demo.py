"""The verb that runs the whole pipeline in one command."""

import time
from pathlib import Path
from typing import TYPE_CHECKING

from tyro.conf import Positional

from evslip.cli.dataset import average
from evslip.utils.console import console
from evslip.utils.errors import ConfigError
from evslip.windows.settings import WindowSettings

if TYPE_CHECKING:
    from evslip.data.dataset import Dataset

TEST_SHARE = 1 / 3


def demo(out: Positional[Path] = Path("demo"), *, count: int = 24, workers: int | None = None, seed: int = 0) -> None:
    """From nothing to a measured slip detector: generate samples, cut windows, train, evaluate, write a report.

    Args:
        out: Folder for everything.
        count: Number of samples; two thirds are for training, the rest is never seen by it.
        workers: Worker processes; default: one a core.
        seed: Seed of everything.
    """
    if count < 6:
        raise ConfigError(f"count: {count} is out of range, expected 6 or more, to have both labels on both sides")
    console.print(f"{out}: {count} samples, windows of them, a detector, its scores, a report")
    from evslip.config.loading import load_config
    from evslip.data.dataset import open_dataset
    from evslip.generation.generate import generate
    from evslip.generation.progress import samples_bar
    from evslip.learn import TrainSettings, train
    from evslip.learn.evaluation.evaluation import evaluate_model
    from evslip.learn.evaluation.evaluation_data import open_evaluation_data
    from evslip.learn.evaluation.stored import FILE, save_evaluation
    from evslip.view.report.report import write_report

    start = time.perf_counter()

    def say(text: str) -> None:
        console.print(f"{time.perf_counter() - start:6.1f} s  {text}")

    held_out = 2 * round(count * TEST_SHARE / 2)  # even, so that both labels occur equally often
    config = load_config("demo", {"seed": seed})
    data, model = out / "data", out / "model"
    made = []
    for split, number in (("train", count - held_out), ("test", held_out)):
        with samples_bar(f"generate {split}") as progress:
            run = generate(config, data, number, split=split, workers=workers, progress=progress)
        made += run.made
    if made:
        say(average(made))
    samples = open_dataset(data)
    for line in describe_truth(samples):
        say(line)

    train_windows = samples.split("train").windows(WindowSettings(hop_s=0.04))
    test_windows = samples.split("test").windows(WindowSettings())
    train_windows.save(out / "windows-train.h5")
    test_windows.save(out / "windows-test.h5")
    say(f"windows: {train_windows.summary()} for training; {test_windows.summary()} for testing")
    result = train(train_windows, model, TrainSettings(seed=seed, epochs=8))
    say(f"trained: {result.summary()}")
    found = evaluate_model(model, open_evaluation_data(out / "windows-test.h5"))
    save_evaluation(model / FILE, [found])
    console.print(found.scores.table())
    page = write_report(out / "report.html", samples, windows=out / "windows-train.h5", model_dir=model)
    say(f"report: {page}")


def describe_truth(samples: "Dataset") -> list[str]:
    """Summary of the physics: largest movement in the hand within 0.16 s over samples that hold, least over those that
    slip."""
    import numpy as np
    from scipy.spatial.transform import Rotation

    held, slipped = [], []
    for position in range(len(samples)):
        truth = samples.read(position, events=False).truth
        if truth is None:
            continue
        turns = Rotation.from_quat(truth.rotation[truth.held], scalar_first=True)
        width = 160
        largest = np.degrees((turns[:-width].inv() * turns[width:]).magnitude()).max(initial=0)
        (held if truth.onset_us is None else slipped).append(largest)
    lines = []
    if held:
        lines.append(f"{len(held)} samples hold: at most {max(held):.4f} deg in any 0.16 s")
    if slipped:
        lines.append(f"{len(slipped)} samples slip: each reaches at least {min(slipped):.2f} deg in 0.16 s")
    return lines
