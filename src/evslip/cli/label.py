"""Verbs about labels that a person gives to recordings."""

from pathlib import Path

from tyro.conf import Positional


def label(recording: Positional[Path], *, out: Path | None = None, port: int = 8899, browser: bool = True) -> None:
    """Mark slip and hold on a recording's time line in the browser. Every change is saved at once. Ctrl-C ends it.

    Args:
        recording: File of events of any known format.
        out: CSV file of the intervals (start_s, end_s, label), which is continued if it is there; default: beside the
            recording, with -labels.csv at its end.
        port: Port on this machine, which alone can reach it; 0 takes a free one.
        browser: Open the page.
    """
    from evslip.view.explorer.labels import Labels
    from evslip.view.explorer.serve import explore
    from evslip.view.explorer.shelf import open_recording

    shelf = open_recording(recording)
    labels = Labels(out or recording.with_name(f"{recording.stem}-labels.csv"))
    explore(shelf, labels=labels, port=port, browser=browser)


def label_agreement(a: Positional[Path], b: Positional[Path]) -> None:
    """Compare two people's labels of one recording: Cohen's kappa over time, and intersection over union.

    Args:
        a: CSV file of one (start_s, end_s, label).
        b: CSV file of the other.
    """
    from evslip.data.intervals import read_intervals
    from evslip.utils.errors import DataError
    from evslip.view.explorer.agreement import agreement

    found = [read_intervals(path) for path in (a, b)]
    for path, intervals in zip((a, b), found, strict=True):
        if not intervals:
            raise DataError(f"{path}: holds no interval; expected one or more to compare")
    print(agreement(*found).table())
