"""What of a detector's calibration error is the share of slips: python benchmarks/calibration.py EVALUATION ...

Training windows are half slips. Where a share s slips, the odds p / (1 - p) want multiplying by s / (1 - s) (Saerens,
Latinne, Decaestecker 2002). Printed are ECE and Brier score of folders of `evslip evaluate`, before and after.
"""

import sys
from pathlib import Path

import numpy as np

from evslip.learn.evaluation.stored import FILE, read_evaluation
from evslip.learn.scores import weighted
from evslip.utils.errors import EvslipError
from evslip.windows.label import Label


def main(*paths: str) -> None:
    if not paths:
        raise ValueError("expected folders that `evslip evaluate` wrote")
    print("| detector | share of slips | ECE | corrected | Brier | corrected |")
    print("|---|---|---|---|---|---|")
    for path in paths:
        for one in read_evaluation(Path(path) / FILE):
            label, p = np.asarray(one.scores.labels), np.asarray(one.scores.probabilities, float)
            share = float(np.mean(label == Label.SLIP))
            both = [weighted.distribution(label, each) for each in (p, weighted.at_share(p, share))]
            cells = [f"{figure(each):.4f}" for figure in (weighted.calibration_error, weighted.brier) for each in both]
            print(f"| {one.model} | {share:.3f} | {' | '.join(cells)} |")


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except (EvslipError, ValueError) as error:
        sys.exit(f"calibration.py: {error}")
