"""Windows in the layout of VT-SNN (https://github.com/clear-nus/VT_SNN), on which the paper's networks are trained."""

from pathlib import Path

import numpy as np

from evslip.codecs import write_events
from evslip.events.stream import Events
from evslip.utils.errors import DataError
from evslip.windows.window_set import SLIP, Windows

FOLDER = "prophesee_recordings"


def export_windows(windows: Windows, out: str | Path) -> int:
    """Write each window as prophesee_recordings/rotate_NN_td.mat or stable_NN_td.mat: times in microseconds since its
    start, pixels of the crop, p of 1 or -1. Returns the number of files. Raises DataError, StorageError."""
    home = Path(out) / FOLDER
    if home.is_dir() and any(home.glob("*.mat")):
        raise DataError(f"{home}: holds .mat files already; expected a new folder")
    counts = {"rotate": 0, "stable": 0}
    digits = max(2, len(str(len(windows))))
    size = windows.settings.width, windows.settings.height
    for i in range(len(windows)):
        name = "rotate" if windows.label[i] == SLIP else "stable"
        counts[name] += 1
        t_us, x, y, p = windows[i]
        events = Events(t_us.astype(np.int64), x.astype(np.uint16), y.astype(np.uint16), p)
        write_events(home / f"{name}_{counts[name]:0{digits}d}_td.mat", events, size)
    return len(windows)
