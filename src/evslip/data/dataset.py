"""A folder of records, as a reader sees it."""

import functools
from collections.abc import Callable, Container
from pathlib import Path

from evslip.config.config import Config
from evslip.config.loading import config_from_text
from evslip.config.views import camera_names
from evslip.data.journal import Entry, read_journals
from evslip.data.layout import CONFIG, JOURNAL, sample_path, sha256_of
from evslip.data.requested import requested_count
from evslip.data.samples import Listing, Samples
from evslip.data.verification import find_problems
from evslip.utils.errors import DataError
from evslip.utils.files import read_text
from evslip.utils.seeds import SPLITS
from evslip.utils.toml import MOST_BYTES


class Dataset(Samples):
    """The simulated records of a data set, in the order train, test, then by index: len(), [i] and iteration.

    Records are read when asked for. `rejections` and `status` speak of all samples.
    """

    def __init__(self, root: str | Path, splits: tuple[str, ...] = SPLITS):
        self.root = root = Path(root)
        self.splits = splits
        in_order = sorted(finished(root).items(), key=lambda item: (SPLITS.index(item[0][0]), item[0][1]))
        self.entries = [entry for (split, _), entry in in_order if split in splits]
        """Entries of all finished samples, rejected ones included."""
        self.rejections = [entry for entry in self.entries if entry["kind"] == "rejected"]
        self.listing = [_listed(root, entry) for entry in self.entries if entry["kind"] == "simulated"]

    def split(self, name: str) -> "Dataset":
        """The part of one split. Raises DataError."""
        if name not in self.splits:
            raise DataError(f"{self.root}: split {name!r} is unknown; expected one of {', '.join(self.splits)}")
        return Dataset(self.root, (name,))

    @functools.cached_property
    def config_toml(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride]
        return read_text(self.root / CONFIG, MOST_BYTES)

    @functools.cached_property
    def config(self) -> Config:
        """The configuration that the samples are drawn from. Raises ConfigError, DataError."""
        return config_from_text(self.config_toml, str(self.root / CONFIG))

    def cameras(self, one: Listing) -> tuple[str, ...]:
        return camera_names(self.config)

    def labels(self) -> list[str]:
        return [listed.label or "hold" for listed in self.listing]

    def status(self) -> dict[str, int]:
        wanted = {split: requested_count(self.root, split) for split in self.splits}
        within = sum(entry["index"] < wanted[entry["split"]] for entry in self.entries)
        missing = sum(wanted.values()) - within
        labels = self.labels()
        return {
            "requested": len(self.entries) + missing,
            "done": len(self.entries),
            "missing": missing,
            "rejected": len(self.rejections),
            "slip": labels.count("slip"),
            "hold": labels.count("hold"),
            "events": sum(entry["events"] for entry in self.entries),
            "bytes": sum(entry["bytes"] for entry in self.entries),
        }

    def verify(self, progress: Callable[[int, int], None] | None = None) -> list[str]:
        """Compare every byte with the journals. One line a problem: damaged, missing, surplus and temporary files.

        A surplus record is one that was written but not journaled before a kill: generating again settles it.
        `progress` is called with the number of files checked and the number in all.
        """
        return find_problems(self.root, self.splits, progress)


def open_dataset(path: str | Path) -> Dataset:
    """Open a data set for reading. Raises DataError."""
    root = Path(path)
    if not root.is_dir():
        raise DataError(
            f"{root}: {'is a file, a folder' if root.exists() else 'no such folder; a data set'} was expected"
        )
    if not (root / CONFIG).is_file():
        state = "not a data set" if any(root.iterdir()) else "the folder is empty"
        raise DataError(f"{root}: {state}; expected the folder that `evslip generate` made, with {CONFIG} in it")
    return Dataset(root)


def finished(
    root: Path, split: str | None = None, indices: Container[int] | None = None
) -> dict[tuple[str, int], Entry]:
    """Entries of the samples that are journaled and whose file is there with the right size, by (split, index).

    Of one split and some indices only, if given: every other file is left unasked.
    """
    entries, _ = read_journals(root / JOURNAL, split, indices)
    done = {}
    for key, candidates in entries.items():
        path = sample_path(root, *key)
        size = _size(path)
        matching = [entry for entry in candidates if entry["bytes"] == size]
        if len({entry["sha256"] for entry in matching}) > 1:
            # Made again with other content of the same size, such as by another version of NumPy: the file tells which.
            digest = sha256_of(path)
            matching = [entry for entry in matching if entry["sha256"] == digest] or matching
        if matching:
            done[key] = matching[-1]
    return done


def _listed(root: Path, entry: Entry) -> Listing:
    path = sample_path(root, entry["split"], entry["index"])
    return Listing(path, entry["name"], entry["split"], entry.get("label", "hold"), entry["events"], entry["sha256"])


def _size(path: Path) -> int | None:
    try:
        return path.stat().st_size
    except OSError:
        return None
