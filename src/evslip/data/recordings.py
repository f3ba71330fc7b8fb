"""A folder of records without a data set around them, such as imported recordings, or a single one."""

from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from evslip.codecs import is_record
from evslip.data import record
from evslip.data.dataset import Dataset, open_dataset
from evslip.data.layout import CONFIG
from evslip.data.record import Record
from evslip.utils.errors import DataError

if TYPE_CHECKING:
    from evslip.windows.window_set import Windows, WindowSettings

SUFFIXES = (".h5", ".hdf5")


class Recordings:
    """The records of a folder's files, by name; or of one file. Read as a Dataset is: len(), [i], iteration."""

    splits: tuple[str, ...] = ()
    config_toml = ""
    rejections: tuple[Any, ...] = ()

    def __init__(self, root: Path):
        self.root = root
        self.files = [root] if root.is_file() else sorted(path for path in root.iterdir() if path.suffix in SUFFIXES)
        self.files = [path for path in self.files if is_record(path)]
        if not self.files:
            raise DataError(f"{root}: no data set ({CONFIG}) and no record of evslip; `evslip import` makes some")

    def __len__(self) -> int:
        return len(self.files)

    def __getitem__(self, position: int) -> Record:
        return self.read(position)

    def __iter__(self) -> Iterator[Record]:
        return (self.read(position) for position in range(len(self)))

    def read(self, position: int, events: bool = True) -> Record:
        """One record; events=False is quicker and leaves its stream empty. Raises DataError, IndexError."""
        return record.read(self.files[position], events)

    def labels(self) -> list[str]:
        """slip, hold or unlabelled of each record."""
        return [label for label, _ in self._facts]

    def status(self) -> dict[str, int]:
        """Counts of samples, events and bytes, as a Dataset has them."""
        labels = self.labels()
        return {
            "requested": len(self),
            "done": len(self),
            "missing": 0,
            "rejected": 0,
            "slip": labels.count("slip"),
            "hold": labels.count("hold"),
            "unlabelled": labels.count("unlabelled"),
            "events": sum(count for _, count in self._facts),
            "bytes": sum(path.stat().st_size for path in self.files),
        }

    def windows(self, settings: "WindowSettings | None" = None) -> "Windows":
        """Labelled windows of all its records. Raises DataError."""
        from evslip.windows.cutting import windows_of

        return windows_of(self, settings)

    @cached_property
    def _facts(self) -> list[tuple[str, int]]:
        return [(sample.label, sample.events.count) for sample in self]


def open_samples(path: str | Path) -> Dataset | Recordings:
    """A data set, a folder of records, or one record. Raises DataError."""
    root = Path(path)
    if root.is_file() or (root.is_dir() and not (root / CONFIG).is_file() and any(root.glob("*.h*5"))):
        return Recordings(root)
    return open_dataset(root)
