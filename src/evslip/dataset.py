"""A folder of records. What is in it is known from the files alone, so any run can take up where another was killed.

config.toml                         what the samples are drawn from
plan-{split}.json                   how many samples were asked for, and the sha256 of config.toml
samples/{split}/000/0000007.h5      records, a thousand a folder
journal/{00..ff}/*.jsonl            name, size and sha256 of every finished record
"""

import functools
import hashlib
import json
import os
import platform
import re
import tomllib
import zlib
from collections.abc import Callable, Container, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from evslip import atomic, record
from evslip.config import Config, config_from_text
from evslip.errors import ConfigError, DataError, StorageError
from evslip.journal import Entry, Journal, read_journals
from evslip.record import Record
from evslip.seeds import SPLITS

if TYPE_CHECKING:
    from evslip.window_set import Windows, WindowSettings

CONFIG, SAMPLES, JOURNAL = "config.toml", "samples", "journal"
_TEMPORARY = re.compile(r"\..+\.[0-9a-f]{8}\.tmp")


class Dataset:
    """The simulated records of a data set, in the order train, test, then by index: len(), [i] and iteration.

    Records are read when asked for. `rejections` and `status` speak of all samples.
    """

    def __init__(self, root: Path, splits: tuple[str, ...] = SPLITS):
        self.root = root
        self.splits = splits
        self.entries = [entry for key, entry in sorted(finished(root).items(), key=_order) if key[0] in splits]
        """Of every finished sample, rejected ones included."""
        self._simulated = [entry for entry in self.entries if entry["kind"] == "simulated"]

    def __len__(self) -> int:
        return len(self._simulated)

    def __getitem__(self, position: int) -> Record:
        return self.read(position)

    def __iter__(self) -> Iterator[Record]:
        return (self.read(position) for position in range(len(self)))

    def read(self, position: int, events: bool = True) -> Record:
        """One record; events=False is quicker and leaves its stream empty. Raises DataError, IndexError."""
        entry = self._simulated[position]
        return record.read(sample_path(self.root, entry["split"], entry["index"]), events)

    def positions(self, names: Container[str]) -> list[int]:
        """Where the simulated records of some names are."""
        return [position for position, entry in enumerate(self._simulated) if entry["name"] in names]

    def split(self, name: str) -> "Dataset":
        """The part of one split. Raises DataError."""
        if name not in self.splits:
            raise DataError(f"{self.root}: split {name!r} is unknown; expected one of {', '.join(self.splits)}")
        return Dataset(self.root, (name,))

    @functools.cached_property
    def config_toml(self) -> str:
        """The text of the configuration that the samples are drawn from. Raises DataError."""
        path = self.root / CONFIG
        try:
            return path.read_text(encoding="utf-8")
        except (OSError, ValueError) as error:
            raise DataError(f"{path}: cannot be read: {error}") from None

    @property
    def config(self) -> Config:
        """The configuration that the samples are drawn from. Raises ConfigError, DataError."""
        return config_from_text(self.config_toml, str(self.root / CONFIG))

    @property
    def rejections(self) -> list[Entry]:
        """The samples whose motion or grasp failed, with the reason in entry["rejection"]."""
        return [entry for entry in self.entries if entry["kind"] == "rejected"]

    def labels(self) -> list[str]:
        """slip or hold of each simulated record, without reading it."""
        return [entry.get("label", "hold") for entry in self._simulated]

    def status(self) -> dict[str, int]:
        """Counts of samples, events and bytes.

        `requested` is the plan plus what was made beyond it, `done` includes the rejected ones, `missing` is the rest.
        """
        planned = {split: _planned(self.root, split) for split in self.splits}
        within = sum(entry["index"] < planned[entry["split"]] for entry in self.entries)
        missing = sum(planned.values()) - within
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
        entries, problems = read_journals(self.root / JOURNAL)
        begun = {split for split, _ in entries}
        lines = [line for split in self.splits for line in _plan_problems(self.root, split, split in begun)]
        problems += dict.fromkeys(lines)
        expected = {sample_path(self.root, *key): wanted for key, wanted in entries.items() if key[0] in self.splits}
        samples = self.root / SAMPLES
        folders = [samples] if self.splits == SPLITS else [samples / split for split in self.splits]
        present = sorted(path for folder in folders for path in folder.rglob("*") if not path.is_dir())
        problems += [f"{path}: missing" for path in sorted(expected.keys() - set(present))]
        kept = [path for path in sorted((self.root / JOURNAL).rglob("*")) if not path.is_dir()]
        problems += [
            f"{path}: a temporary file left behind"
            for path in [*sorted(self.root.glob(".*.tmp")), *kept]
            if _TEMPORARY.fullmatch(path.name)
        ]
        problems += [
            f"{path}: surplus, not a journal"
            for path in kept
            if path.suffix != ".jsonl" and not _TEMPORARY.fullmatch(path.name)
        ]
        for done, path in enumerate(present, 1):
            if _TEMPORARY.fullmatch(path.name):
                problems.append(f"{path}: a temporary file left behind")
            elif path not in expected:
                problems.append(f"{path}: surplus, no journal knows it")
            elif _sha256(path) not in {entry["sha256"] for entry in expected[path]}:
                problems.append(f"{path}: damaged, its sha256 is not the one it was written with")
            if progress:
                progress(done, len(present))
        return problems

    def windows(self, settings: "WindowSettings | None" = None) -> "Windows":
        """Labelled windows of all its records. Raises DataError."""
        from evslip.windows import windows_of

        return windows_of(self, settings)


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


def create(root: Path, config_toml: str) -> None:
    """Make a data set, or check that the one there has the same configuration.

    Raises ConfigError with the difference if not, DataError if the folder holds something else, StorageError.
    """
    path = root / CONFIG
    if not path.exists():
        with atomic.storage_errors(root):
            names = [p.name for p in root.iterdir()] if root.is_dir() else []
        foreign = [name for name in names if name != CONFIG and not _TEMPORARY.fullmatch(name)]
        if foreign and not path.exists():  # another process may have made it meanwhile
            raise DataError(f"{root}: holds {sorted(foreign)[0]} but no {CONFIG}; expected a data set or a new folder")
        try:
            atomic.write_new(path, config_toml.encode())
        except StorageError:
            if not path.exists():  # as in `add`
                raise
    require_config(root, config_toml)
    _sweep(path)
    _sweep_finished(root)


def require_config(root: Path, config_toml: str) -> None:
    """Raise ConfigError with the difference unless the data set's configuration is this one, DataError without one."""
    path = root / CONFIG
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise DataError(f"{path}: is not there on {platform.node()}; expected a folder that all nodes share") from None
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: cannot be read: {error}") from None
    if text == config_toml:
        return
    try:
        there = tomllib.loads(text)
    except ValueError as error:
        raise DataError(f"{path}: cannot be read: {error}") from None
    differences = list(_differences(_leaves(there), _leaves(tomllib.loads(config_toml))))
    if differences:
        shown = "; ".join(differences[:3]) + (f"; and {len(differences) - 3} more" if len(differences) > 3 else "")
        raise ConfigError(f"{root}: holds a data set of another configuration: {shown}; expected a new folder")


def plan(root: Path, split: str, count: int) -> None:
    """Note that a split shall have at least `count` samples. Raises StorageError."""
    path = _plan_path(root, split)
    if count > _planned(root, split):
        try:
            atomic.write_bytes(path, _plan_bytes(count, _sha256(root / CONFIG)))
        except StorageError:
            # As in `add`: another process's sweep may have taken our temporary file; then its plan is in place.
            if count > _planned(root, split):
                raise
    _sweep(path)


def add(root: Path, sample: Record, data: bytes) -> Entry:
    """Write an encoded record into its place, then into the journal. Returns the journal's entry.

    Two processes may add the same sample at the same time: their bytes are equal. Raises StorageError.
    """
    if sample.split is None or sample.index is None:
        raise DataError(f"{sample.name}: a record of a data set needs a split and an index")
    path = sample_path(root, sample.split, sample.index)
    try:
        atomic.write_bytes(path, data)
    except StorageError:
        # The other process's sweep may have taken our temporary file; then its record is in place.
        if not path.is_file() or path.read_bytes() != data:
            raise
    _sweep(path)
    entry = Entry(
        name=sample.name,
        split=sample.split,
        index=sample.index,
        kind=sample.kind,
        sha256=hashlib.sha256(data).hexdigest(),
        bytes=len(data),
        events=sample.events.count,
    )
    if sample.truth is not None:
        entry["label"] = "hold" if sample.truth.onset_us is None else "slip"
    if sample.rejection is not None:
        entry["rejection"] = list(sample.rejection)
    _journal(root, os.getpid()).append(entry)
    return entry


def finished(
    root: Path, split: str | None = None, indices: Container[int] | None = None
) -> dict[tuple[str, int], Entry]:
    """Entries of the samples that are journaled and whose file is there with the right size, by (split, index).

    Of one split and some indices only, if given: every other file is left unasked.
    """
    entries, _ = read_journals(root / JOURNAL, split, indices)
    done = {}
    for key, candidates in entries.items():
        size = _size(sample_path(root, *key))
        matching = [entry for entry in candidates if entry["bytes"] == size]
        if matching:
            done[key] = matching[-1]
    return done


def sample_path(root: Path, split: str, index: int) -> Path:
    """Where a sample's record is."""
    return root / SAMPLES / split / f"{index // 1000:03d}" / f"{index:07d}.h5"


@functools.lru_cache(maxsize=4)
def _journal(root: Path, pid: int) -> Journal:
    # Keyed by the process, so that a forked child begins a file of its own.
    del pid
    return Journal(root / JOURNAL)


def _order(item: tuple[tuple[str, int], Entry]) -> tuple[int, int]:
    (split, index), _ = item
    return SPLITS.index(split), index


def _plan_path(root: Path, split: str) -> Path:
    return root / f"plan-{split}.json"


def _plan_bytes(count: int, config_sha256: str | None) -> bytes:
    plan = {"count": count, "config_sha256": config_sha256}
    return json.dumps({**plan, "crc32": zlib.crc32(json.dumps(plan).encode())}).encode() + b"\n"


def _plan_problems(root: Path, split: str, is_needed: bool) -> list[str]:
    """What is wrong with a plan and, by the hash in it, with the configuration; one line a problem."""
    path = _plan_path(root, split)
    if not path.is_file():
        return [f"{path}: missing"] if is_needed else []
    data, plan = path.read_bytes(), _plan(root, split)
    if data == json.dumps({"count": plan.get("count")}).encode() + b"\n":  # as the first versions wrote it
        return []
    if data != _plan_bytes(plan.get("count", 0), plan.get("config_sha256")):
        return [f"{path}: damaged"]
    if plan["config_sha256"] != _sha256(root / CONFIG):
        return [f"{root / CONFIG}: damaged, its sha256 is not the one in {path.name}"]
    return []


def _plan(root: Path, split: str) -> dict[str, Any]:
    try:
        plan = json.loads(_plan_path(root, split).read_bytes())
    except (OSError, ValueError):
        return {}
    return plan if isinstance(plan, dict) else {}


def _planned(root: Path, split: str) -> int:
    count = _plan(root, split).get("count")
    return count if isinstance(count, int) else 0


def _sweep(path: Path) -> None:
    """Remove temporary files that killed writers of this path left beside it."""
    for left in path.parent.glob(f".*{path.name}.*.tmp"):
        left.unlink(missing_ok=True)


def _sweep_finished(root: Path) -> None:
    """Remove temporary files of samples that are finished. Those of others go when they are made again."""
    left = [path for path in (root / SAMPLES).rglob(".*.tmp") if _TEMPORARY.fullmatch(path.name)]
    if left:
        whole = {sample_path(root, *key) for key in finished(root)}
        for path in left:
            if path.with_name(path.name.lstrip(".").rsplit(".", 2)[0]) in whole:
                path.unlink(missing_ok=True)


def _size(path: Path) -> int | None:
    try:
        return path.stat().st_size
    except OSError:
        return None


def _sha256(path: Path) -> str | None:
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return None


def _leaves(tree: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    leaves = {}
    for key, value in tree.items():
        leaves |= _leaves(value, f"{prefix}{key}.") if isinstance(value, dict) else {prefix + key: value}
    return leaves


def _differences(there: dict[str, Any], here: dict[str, Any]) -> Iterator[str]:
    for key in there | here:
        if there.get(key) != here.get(key):
            yield f"{key} is {there.get(key, 'absent')} there and {here.get(key, 'absent')} now"
