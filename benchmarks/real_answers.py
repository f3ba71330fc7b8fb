"""What detectors say of real recordings in which nothing is held, so that every alarm is a false one.

python benchmarks/real_answers.py FOLDER [--model default] [--model MODEL ...]

Each recording of the folder, of any format that evslip reads, is answered every 20 ms on the crop that `evslip detect
--align centre` chooses. Alarms less than 0.2 s apart are one, as in `evslip evaluate`. Prints a Markdown table.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from evslip.codecs.formats import recordings_in
from evslip.data.record_file import open_recording
from evslip.learn.evaluation.alarms import begin_alarms
from evslip.learn.streaming.stream import Detection, detect
from evslip.utils.errors import EvslipError

HOP_S = 0.02


def alarms(detection: Detection) -> int:
    """Alarms at the detector's own threshold."""
    loud = detection.p_slip >= detection.threshold
    return int(begin_alarms(detection.t_us[loud], 1e6 * HOP_S).sum())


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
    for path in recordings_in(options.folder):
        try:
            row = list(cells(path, models))
        except EvslipError as error:
            row = [f"refused: {error}", "–", *["–"] * len(models)]
        print(f"| {path.name} | " + " | ".join(row) + " |")


if __name__ == "__main__":
    main()
