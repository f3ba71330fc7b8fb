"""A folder of records without a data set around them, such as imported recordings, or a single one."""

from functools import cached_property
from pathlib import Path

from evslip.codecs.formats import HDF5
from evslip.data.dataset import open_dataset
from evslip.data.layout import CONFIG
from evslip.data.record_file import ALL_CAMERAS, is_record, is_rejected
from evslip.data.samples import Listing, Samples
from evslip.utils.errors import DataError


class Recordings(Samples):
    """The records of a folder's files, by name; or of one file. Rejected samples, of which nothing was filmed, are left
    out."""

    def __init__(self, root: Path):
        self.root = root
        files = (
            [root]
            if root.is_file()
            else sorted(path for path in root.iterdir() if path.suffix.lower() in HDF5.suffixes)
        )
        records = [path for path in files if is_record(path)]
        self.listing = [Listing(path, path.stem) for path in records if not is_rejected(path)]
        if records and not self.listing:
            raise DataError(f"{root}: rejected samples alone, of which nothing was filmed; expected other records")
        if not records:
            raise DataError(f"{root}: no data set ({CONFIG}) and no record of evslip; `evslip import` makes some")

    @cached_property
    def _labels(self) -> list[str]:
        return [record.label for record in self.without_events()]

    def labels(self) -> list[str]:
        return self._labels

    def status(self) -> dict[str, int]:
        labels = self.labels()
        return {
            "requested": len(self),
            "done": len(self),
            "missing": 0,
            "rejected": 0,
            **{name: labels.count(name) for name in ("slip", "hold", "unlabelled")},
            "events": sum(record.events.count for record in self.seen_by(ALL_CAMERAS)),
            "bytes": sum(listed.path.stat().st_size for listed in self.listing),
        }


def open_samples(path: str | Path) -> Samples:
    """A data set, a folder of records, or one record. Raises DataError."""
    root = Path(path)
    if root.is_file() or (root.is_dir() and not (root / CONFIG).is_file() and any(root.glob("*.h*5"))):
        return Recordings(root)
    return open_dataset(root)
