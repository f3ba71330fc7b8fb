"""Data that a detector is evaluated on: a data set, a folder or file of records, or windows that were cut before."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from evslip.data.dataset import Dataset, open_dataset
from evslip.data.layout import CONFIG
from evslip.data.record import Record
from evslip.data.recordings import open_samples
from evslip.data.samples import Samples
from evslip.utils import hdf5
from evslip.utils.errors import DataError
from evslip.windows.alignment import laid_on
from evslip.windows.cutting import crop, labelled
from evslip.windows.label import Label
from evslip.windows.settings import Align
from evslip.windows.window_set import FORMAT, WindowEvents, Windows, WindowSettings, open_windows


@dataclass(frozen=True)
class EvaluationData:
    """Data to examine detectors on. Either windows, or records that are read when asked for."""

    name: str
    """For a person: the path and the split."""
    windows: Windows | None = None
    samples: Samples | None = None
    notes: tuple[str, ...] = ()
    """Remarks on the data for a reader of the figures."""

    def __iter__(self) -> Iterator[Record]:
        return iter(self.samples or ())

    def named(self, names: Collection[str]) -> Iterator[Record]:
        """Records of some names; no other one is read."""
        if self.samples is not None:
            yield from map(self.samples.read, self.samples.positions(names))

    def __len__(self) -> int:
        """Number of records."""
        return len(self.samples or ())

    @property
    def steps(self) -> int:
        """Steps of an evaluation: windows, or else records."""
        return len(self) if self.windows is None else len(self.windows)

    def some_windows(
        self, settings: WindowSettings, most: int = 48, align: Align | None = None
    ) -> Sequence[WindowEvents]:
        """A few windows evenly from the first records that have some which hold or slip, to time a detector on. Raises
        DataError if none has."""
        if self.windows is not None:
            return [self.windows[i] for i in _evenly(len(self.windows), most)]
        clear = ((record, starts) for record in self if (starts := _clear_starts(record, settings)))
        first = list(islice(clear, 3))
        if not first:
            raise DataError(
                f"{self.name}: no window of {settings.length_s:g} s in which an object is held and holds or slips; "
                "expected more records"
            )
        cut = [
            (inside, start_us)
            for record, starts in first
            for inside in [crop(record.events, laid_on(settings, record.size, align or "centre"))]
            for start_us in starts
        ]
        length_us = round(settings.length_s * 1e6)
        some = (cut[i] for i in _evenly(len(cut), most))
        return [WindowEvents.of(inside.between(start, start + length_us), start) for inside, start in some]


def _clear_starts(record: Record, settings: WindowSettings) -> list[int]:
    """When a record's windows begin that hold or slip."""
    return [movement.start_us for movement, label in labelled(record, settings) if label != Label.UNCERTAIN]


def _evenly(number: int, most: int) -> list[int]:
    """Positions of at most so many of a number of things."""
    return np.unique(np.linspace(0, number - 1, min(most, number)).astype(int)).tolist()


def open_evaluation_data(path: str | Path, split: str | None = None, camera: str | None = None) -> EvaluationData:
    """Open a data set's folder, a folder of records, one record, or a file of windows. Raises DataError.

    Of a data set, `split` is examined; without one, the test split if it has one, else everything. camera: of samples
    that several saw, the one whose events are examined.
    """
    path = Path(path)
    if (path / CONFIG).is_file():
        return _of_dataset(open_dataset(path), split, camera)
    if split is not None:
        raise DataError(f"{path}: not a data set, so it has no split {split!r}")
    if path.is_dir():
        if not any(path.glob("*.h5")):
            raise DataError(f"{path}: neither a data set nor a folder with records (*.h5)")
        samples = open_samples(path).seen_by(camera)
        return EvaluationData(f"{path}, {len(samples)} records", samples=samples)
    if _is_windows(path):
        if camera is not None:
            raise DataError(f"{path}: windows are cut already; expected camera with records")
        windows = open_windows(path)
        if not len(windows):
            raise DataError(f"{path}: holds no window; expected a file of `evslip windows` that has some")
        return EvaluationData(str(path), windows=windows)
    return EvaluationData(str(path), samples=open_samples(path).seen_by(camera))


def _of_dataset(dataset: Dataset, split: str | None, camera: str | None) -> EvaluationData:
    notes: tuple[str, ...] = ()
    if split is None:
        held_out = dataset.split("test")
        if len(held_out):
            dataset, split = held_out, "test"
        else:
            notes = ("the data set has no test split: a detector that was trained on some of its samples is flattered",)
    else:
        dataset = dataset.split(split)
    if not len(dataset):
        raise DataError(f"{dataset.root}: no sample{f' in split {split}' if split else ''} to evaluate on")
    seen = "" if camera is None else f", camera {camera}"
    name = f"{dataset.root}, {split or 'all samples'}{seen}"
    return EvaluationData(name, samples=dataset.seen_by(camera), notes=notes)


def _is_windows(path: Path) -> bool:
    if not path.is_file():
        raise DataError(f"{path}: no such file; expected a data set, a record or a file of `evslip windows`")
    with hdf5.opened(path) as file:
        return file.attrs.get("format") == FORMAT
