"""Layout of VT-SNN (https://github.com/clear-nus/VT_SNN), on which the paper's networks are trained."""

from dataclasses import replace
from pathlib import Path

from evslip.codecs import open_events, write_events
from evslip.codecs.source import events_of, size_of
from evslip.data import record_file
from evslip.data.intervals import Interval, LabelName
from evslip.exchange.importing.event_files import read_event_file
from evslip.exchange.importing.settings import Importing
from evslip.utils import atomic
from evslip.utils.errors import DataError
from evslip.utils.progress import over
from evslip.windows.label import Label
from evslip.windows.window_set import Windows

VT_SNN = "prophesee_recordings"
LABELS: dict[str, LabelName] = {"rotate": "slip", "rotation": "slip", "stable": "hold"}
"""Folder of its files, and what the first word of their names says."""


def export_windows(windows: Windows, out: str | Path) -> int:
    """Write each window as prophesee_recordings/rotate_NN_td.mat or stable_NN_td.mat: times in microseconds since its
    start, pixels of the crop, p of 1 or -1. All of them, or none. Returns the number of files. Raises DataError,
    StorageError."""
    check_folder(out)
    counts = {"rotate": 0, "stable": 0}
    digits = max(2, len(str(len(windows))))
    size = windows.settings.width, windows.settings.height
    with atomic.staged_folder(Path(out) / VT_SNN) as home:
        for i in over("files of VT-SNN", range(len(windows))):
            name = "rotate" if windows.label[i] == Label.SLIP else "stable"
            counts[name] += 1
            write_events(home / f"{name}_{counts[name]:0{digits}d}_td.mat", events_of(*windows[i].columns), size)
    return len(windows)


def check_folder(out: str | Path) -> None:
    """Raise DataError or StorageError where `export_windows` could not write, as far as that is seen without writing:
    before long work."""
    home = Path(out) / VT_SNN
    atomic.require_place(home / "stable_01_td.mat")
    if home.is_dir() and any(home.iterdir()):
        raise DataError(f"{home}: is there already; expected a new folder")


def import_vt_snn(
    folder: str | Path, out: str | Path, length_s: float = 0.15, size: tuple[int, int] | None = None
) -> list[Path]:
    """Bring the files rotate_*.mat and stable_*.mat of VT-SNN's layout into a folder of records, labelled throughout.
    Their times stay: 0 is the start of the window.

    length_s: how long a file lasts, since it does not say; longer, if its last event is later. size: width and height
    of the sensor; default: the extent of all files' events. Raises DataError, StorageError.
    """
    folder, out = Path(folder), Path(out)
    home = folder / VT_SNN if (folder / VT_SNN).is_dir() else folder
    files = sorted(home.glob("*.mat"))
    if not files:
        raise DataError(f"{home}: holds no .mat files, expected such as rotate_01_td.mat and stable_01_td.mat")
    common = size
    if common is None:
        width, height = zip(*(size_of(open_events(file)) for file in files), strict=True)
        common = max(width), max(height)
    written = []
    for file in over("files", files):
        label = LABELS.get(file.name.split("_")[0].lower())
        made = replace(read_event_file(file, Importing(frames=False, size=size), from_zero=False), size=common)
        if label is not None:
            last_us = int(made.events.t_us[-1]) if made.events.count else 0
            interval = Interval(0, max(round(length_s * 1e6), last_us + 1), label)
            made = replace(made, intervals=(interval,))
        written.append(out / f"{file.stem}.h5")
        record_file.write(written[-1], made)
    return written


def is_vt_snn(folder: Path) -> bool:
    """Whether a folder has VT-SNN's layout."""
    return (folder / VT_SNN).is_dir() or (folder.name == VT_SNN and folder.is_dir())
