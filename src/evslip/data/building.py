"""Making a data set: its folder, and one record after the other."""

import functools
import hashlib
import os
import platform
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from evslip.data import requested
from evslip.data.dataset import finished
from evslip.data.journal import Entry, Journal
from evslip.data.layout import CONFIG, JOURNAL, SAMPLES, is_temporary, sample_path, sha256_of, sweep
from evslip.data.record import Record
from evslip.utils import atomic
from evslip.utils.errors import ConfigError, DataError, StorageError
from evslip.utils.files import read_text
from evslip.utils.toml import MOST_BYTES, parse_toml


def create(root: Path, config_toml: str) -> None:
    """Make a data set, or check that the one there has the same configuration.

    Where its file of the configuration is gone or damaged, and the plan knows this one's sum, it is written again.
    Raises ConfigError with the difference if not, DataError if the folder holds something else, StorageError.
    """
    path = root / CONFIG
    if _is_lost(path, config_toml) and requested.vouches_for(root, config_toml):
        atomic.write_bytes(path, config_toml.encode())
    if not path.exists():
        with atomic.storage_errors(root):
            there = list(root.iterdir()) if root.is_dir() else []
        foreign = [file.name for file in there if file.name != CONFIG and not is_temporary(file)]
        if foreign and not path.exists():  # another process may have made it meanwhile
            raise DataError(f"{root}: holds {sorted(foreign)[0]} but no {CONFIG}; expected a data set or a new folder")
        try:
            atomic.write_new(path, config_toml.encode())
        except StorageError:
            if not path.exists():  # as in `add`
                raise
    require_config(root, config_toml)
    sweep(path)
    _sweep_finished(root)


def _is_lost(path: Path, config_toml: str) -> bool:
    """Whether a configuration's file may be written again: there is none, or one of other bytes."""
    if not path.exists():
        return True
    return path.is_file() and sha256_of(path) != hashlib.sha256(config_toml.encode()).hexdigest()


def require_config(root: Path, config_toml: str) -> None:
    """Raise ConfigError with the difference unless the data set's configuration is this one, DataError without one."""
    path = root / CONFIG
    if not path.exists():
        raise DataError(f"{path}: is not there on {platform.node()}; expected a folder that all nodes share")
    text = read_text(path, MOST_BYTES)
    if text == config_toml:
        return
    try:
        there = parse_toml(text)
    except ValueError as error:
        raise DataError(f"{path}: cannot be read: {error}") from None
    differences = list(_differences(_leaves(there), _leaves(parse_toml(config_toml))))
    if differences:
        shown = "; ".join(differences[:3]) + (f"; and {len(differences) - 3} more" if len(differences) > 3 else "")
        raise ConfigError(f"{root}: holds a data set of another configuration: {shown}; expected a new folder")


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
    sweep(path)
    entry = Entry(
        name=sample.name,
        split=sample.split,
        index=sample.index,
        kind=sample.kind,
        sha256=hashlib.sha256(data).hexdigest(),
        bytes=len(data),
        events=sample.count,
    )
    if sample.truth is not None:
        entry["label"] = "hold" if sample.truth.onset_us is None else "slip"
    if sample.rejection is not None:
        entry["rejection"] = list(sample.rejection)
    _journal(root, os.getpid()).append(entry)
    return entry


@functools.lru_cache(maxsize=4)
def _journal(root: Path, pid: int) -> Journal:
    # Keyed by the process, so that a forked child begins a file of its own.
    del pid
    return Journal(root / JOURNAL)


def _sweep_finished(root: Path) -> None:
    """Remove temporary files of samples that are finished. Those of others go when they are made again."""
    left = [path for path in (root / SAMPLES).rglob(".*.tmp") if is_temporary(path)]
    if left:
        whole = {sample_path(root, *key) for key in finished(root)}
        for path in left:
            if path.with_name(path.name.lstrip(".").rsplit(".", 2)[0]) in whole:
                path.unlink(missing_ok=True)


def _leaves(tree: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    leaves = {}
    for key, value in tree.items():
        leaves |= _leaves(value, f"{prefix}{key}.") if isinstance(value, dict) else {prefix + key: value}
    return leaves


def _differences(there: dict[str, Any], here: dict[str, Any]) -> Iterator[str]:
    for key in there | here:
        if there.get(key) != here.get(key):
            yield f"{key} is {there.get(key, 'absent')} there and {here.get(key, 'absent')} now"
