"""What detectors say of real recordings in which nothing is held, so that every alarm is a false one.

python benchmarks/real_answers.py FOLDER [--model default] [--model MODEL ...]

Each recording of the folder, of any format that evslip reads, is answered every 20 ms on the crop that `evslip detect
--align centre` chooses. Alarms less than 0.2 s apart are one, as in `evslip evaluate`. Prints a Markdown table.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from evslip.codecs import known_suffixes
from evslip.data.record_file import open_recording
from evslip.learn.evaluation.alarms import MERGE_US
from evslip.learn.streaming.stream import Detection, detect
from evslip.utils.errors import EvslipError

HOP_S = 0.02


def recordings(folder: Path) -> list[Path]:
    """Files of events, and folders that are one recording (bags of ROS 2)."""
    found = sorted(folder.iterdir())
    return [one for one in found if one.suffix in known_suffixes() or (one / "metadata.yaml").is_file()]


def alarms(detection: Detection) -> int:
    """Runs of answers that say slip, those less than 0.2 s apart taken for one."""
    loud = detection.t_us[detection.p_slip >= detection.threshold]
    return int(len(loud) > 0) + int((np.diff(loud) >= MERGE_US + HOP_S * 1e6).sum())


def cells(path: Path, models: list[str]) -> Iterator[str]:
    """The row of one recording: what it is, then what each detector says."""
    for number, model in enumerate(models):
        record, parts = open_recording(path, None)  # each detector reads it from the start
        size = record.size
        try:
            found = detect(model, parts, size, align="centre", hop_s=HOP_S)
        except EvslipError as error:
            yield from ([f"{size[0]} x {size[1]}", "–"] if number == 0 else [])
            yield f"refused: {str(error).split(': ', 1)[-1]}"
            continue
        if number == 0:
            yield from (f"{size[0]} x {size[1]}", f"{(found.t_us[-1] - found.start_us) / 1e6:.2f}")
        share, median = (found.p_slip >= found.threshold).mean(), np.median(found.p_slip)
        yield f"{alarms(found)}; {share:.0%} of {len(found.t_us)} answers; {median:.2f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--model", action="append", help="folder or name of a detector; default: default")
    options = parser.parse_args()
    if not options.folder.is_dir():
        raise SystemExit(f"{options.folder}: no such folder; expected one with recordings")
    models = options.model or ["default"]
    said = [f"`{Path(model).name}`: alarms; share said slip; median probability" for model in models]
    print("| " + " | ".join(["recording", "sensor", "s", *said]) + " |")
    print("|" + "---|" * (3 + len(models)))
    for path in recordings(options.folder):
        try:
            row = list(cells(path, models))
        except EvslipError as error:
            row = [f"refused: {error}", "–", *["–"] * len(models)]
        print(f"| {path.name} | " + " | ".join(row) + " |")


if __name__ == "__main__":
    main()
