"""Verbs that open pages on this machine: looking at data, and labelling it by hand."""

from pathlib import Path
from typing import Literal

from tyro.conf import Positional

from evslip.utils.console import console, progress_bar


def view(dataset: Positional[Path], *, model: Path | None = None, port: int = 8899, browser: bool = True) -> None:
    """Look at a data set or a recording in the browser: frames, events, curves, labels. Ctrl-C ends it.

    Args:
        dataset: Folder of a data set, or a file of events of any known format.
        model: Folder of a detector, or `default`, the one of the package, whose slip probability is drawn over time.
        port: Port on this machine, which alone can reach it; 0 takes a free one.
        browser: Open the page.
    """
    from evslip.view.explorer.serve import explore
    from evslip.view.explorer.shelf import open_shelf

    explore(open_shelf(dataset), model=model, port=port, browser=browser, show=_say)


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
    explore(shelf, labels=labels, port=port, browser=browser, show=_say)


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


def video(
    records: Positional[tuple[Path, ...]],
    *,
    out: Path,
    what: Literal["both", "frames", "events"] = "both",
    speed: float = 0.1,
    window_ms: float = 10.0,
    start_s: float | None = None,
    end_s: float | None = None,
) -> None:
    """Write a slow-motion video of a sample or a recording, of several side by side: frames, events, angle.

    Args:
        records: Files of events of any known format; only samples of evslip have frames and angles.
        out: Video to write (.mp4, .mkv, .mov, .avi).
        what: Events over frames, frames alone, or events alone.
        speed: Of playing, against true time.
        window_ms: Each picture shows the events of this time before it.
        start_s: First time; default: the beginning of what is recorded.
        end_s: Last time; default: its end.
    """
    from evslip.data.record_file import read_recording
    from evslip.utils.errors import ConfigError
    from evslip.view.pictures.slip_video import Film, FilmSettings
    from evslip.view.pictures.video import check_video

    check_video("out", out)
    if not records:
        raise ConfigError("records: expected one or more files")
    settings = FilmSettings(what, speed, window_ms, start_s, end_s)
    film = Film([read_recording(path) for path in records], settings)
    with progress_bar("video", len(film)) as advance:
        film.write(out, advance)
    console.print(f"{out}: {len(film)} pictures")


def rerun(source: Positional[Path], out: Positional[Path], *, count: int = 4) -> None:
    """Write a file for the Rerun viewer: robot, poses, camera, frames, events and curves on one time line.

    Args:
        source: Folder of a data set, or a file of events of any known format.
        out: File to write (.rrd); `rerun FILE` opens it.
        count: Samples of a data set, from the first on.
    """
    from evslip.utils.errors import ConfigError
    from evslip.view.explorer.shelf import open_shelf
    from evslip.view.rerun_log import check_rerun, write_rerun

    check_rerun(out)
    if count < 1:
        raise ConfigError(f"count: {count} is out of range, expected 1 or more")
    shelf = open_shelf(source)
    number = min(count, len(shelf))
    with progress_bar("rerun", number) as advance:
        write_rerun(out, (shelf.read(position) for position in range(number)), advance)
    console.print(f"{out}: {number} samples")


def _say(address: str) -> None:
    console.print(f"{address}  (Ctrl-C ends it)", soft_wrap=True)
