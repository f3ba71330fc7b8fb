"""Each window as a video and as single pictures, with and without its events: what a person checks labels by."""

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np

from evslip.data.record import Record
from evslip.data.samples import Samples
from evslip.events.overlay import overlay
from evslip.utils import atomic
from evslip.utils.errors import ConfigError, DataError
from evslip.view.pictures.frame_source import FrameSource
from evslip.view.pictures.images import encoded
from evslip.view.pictures.slip_video import Film, FilmSettings
from evslip.windows.label import Label
from evslip.windows.window_set import Windows

PICTURES = 8
"""Single pictures of a window, evenly in time; each shows the events since the one before."""


def name_of(windows: Windows, index: int) -> str:
    """By label, change of angle, sample and start: names sort by what a person looks for."""
    label = "slip" if windows.label[index] == Label.SLIP else "hold"
    sample = windows.name[index].replace("/", "-")
    return f"{label}_{windows.rotation_deg[index]:07.3f}deg_{sample}_{int(windows.start_us[index]) // 1000:06d}ms"


def check_folder(folder: Path) -> None:
    """Raise DataError where a file is in the way."""
    if folder.exists() and not folder.is_dir():
        raise DataError(f"{folder}: is a file; expected a folder, new or not")


def check_cameras(samples: Samples) -> None:
    """Raise ConfigError for samples as several cameras saw them: a window does not say which of them saw it."""
    names = [listed.name for listed in samples.listing]
    if len(set(names)) < len(names):
        raise ConfigError(
            "visualize: a window does not say which of several cameras saw it; expected --camera left or right"
        )


def write_windows(
    folder: Path, windows: Windows, samples: Samples, progress: Callable[[], None] = lambda: None
) -> None:
    """Write NAME.mp4, NAME_k.png and NAME_k_events.png of each window into a folder; see `name_of`.

    Windows must be of the data set's simulated samples. `progress` is called after each. Raises ConfigError for
    samples as several cameras saw them, DataError, StorageError.
    """
    check_folder(folder)
    check_cameras(samples)
    for position, listed in enumerate(samples.listing):
        chosen = np.flatnonzero(windows.name == listed.name)
        if len(chosen):
            record = samples.read(position)
            sight = FrameSource(record)
            for index in chosen:
                _write(folder / name_of(windows, int(index)), record, sight, windows, int(windows.start_us[index]))
                progress()


def _write(stem: Path, record: Record, sight: FrameSource, windows: Windows, start_us: int) -> None:
    end_us = start_us + round(1e6 * windows.settings.length_s)
    times = np.linspace(start_us, end_us, PICTURES + 1).astype(np.int64)
    for number, (before, t_us) in enumerate(pairwise(times)):
        frame = sight.at(int(t_us))
        seen = overlay(frame, record.events.between(before, t_us))
        for name, picture in ((f"{number}", frame), (f"{number}_events", seen)):
            atomic.write_bytes(stem.with_name(f"{stem.name}_{name}.png"), encoded(picture, "PNG"))
    settings = FilmSettings(start_s=start_us / 1e6, end_s=end_us / 1e6, speed=0.1, window_ms=5.0)
    Film([record], settings).write(stem.with_name(f"{stem.name}.mp4"))
