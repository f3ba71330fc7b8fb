"""Writes a data set's publication: all of it, or nothing."""

import hashlib
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from evslip.data.recordings import open_samples
from evslip.data.samples import Listing
from evslip.exchange.publishing.card import card
from evslip.exchange.publishing.croissant import METADATA, croissant
from evslip.exchange.publishing.publication import Publication
from evslip.exchange.publishing.shards import Shards, check_key
from evslip.exchange.publishing.table import json_line, row
from evslip.utils import atomic
from evslip.utils.errors import DataError
from evslip.utils.files import printable
from evslip.utils.progress import Step

RECORDINGS = "recordings"
"""Split of records that are in no split."""


def publish(source: str | Path, out: str | Path, how: Publication | None = None) -> int:
    """Write the publication of a data set, a folder of records or one record to a new folder. Returns the number of
    samples.

    Equal samples give equal bytes. Raises DataError, also for a record that has changed since it was written,
    ConfigError, StorageError.
    """
    how, out = how or Publication(), Path(out)
    if how.lerobot:
        from evslip.exchange.publishing.lerobot import publish_lerobot

        return publish_lerobot(source, out, how)
    samples = open_samples(source)
    if not samples.listing:
        raise DataError(f"{source}: holds no finished sample")
    config = samples.config_toml
    name = how.name_of(source)
    with atomic.staged_folder(out) as folder:
        (folder / "data").mkdir()
        splits = _write_data(samples.listing, folder / "data", how)
        tables = {s: _write(folder / f"{s}.jsonl", map(json_line, rows)) for s, rows in splits.items()}
        text = card(name, how.license, splits, config, how.webdataset, how.huggingface)
        _write(folder / "README.md", [text.encode()])
        data = [
            (f"{split}-shards", "application/x-tar", f"data/{split}-*.tar")
            if how.webdataset
            else (f"{split}-records", "application/x-hdf5", f"data/{split}/*.h5")
            for split in splits
        ]
        about = text.split("\n\n")[1]
        licence = f"https://spdx.org/licenses/{how.license}"
        _write(folder / METADATA, [croissant(name, about, licence, tables, data, how.metadata).encode()])
        if config:
            _write(folder / "config.toml", [config.encode()])
    return len(samples)


def _write_data(listing: Sequence[Listing], folder: Path, how: Publication) -> dict[str, list[dict[str, Any]]]:
    """The table of each split; the records are written on the way."""
    splits: dict[str, list[dict[str, Any]]] = {item.split or RECORDINGS: [] for item in listing}
    keys = _keys(listing, how.webdataset)
    with Step("publish", len(listing)) as advance:
        for split, rows in splits.items():
            shards = Shards(folder, split, round(how.shard_mb * 1e6))
            for item in (item for item in listing if (item.split or RECORDINGS) == split):
                key = keys[item.path]
                file = f"data/{shards.current}/{key}.h5" if how.webdataset else f"data/{split}/{key}.h5"
                values, data = row(item, file)
                if how.webdataset:
                    shards.add(key, data, values)
                else:
                    (folder / split).mkdir(exist_ok=True)
                    _write(folder / split / f"{key}.h5", [data])
                rows.append(values)
                advance()
            shards.close()
    return splits


def _keys(listing: Sequence[Listing], webdataset: bool) -> dict[Path, str]:
    """Names of the records' files without suffix; in shards, whose readers take what follows the first dot for the
    suffix, without dots. Raises DataError for two of one name, and for one that is too long for a shard."""
    keys, taken = {}, {}
    for item in listing:
        stem = printable(item.path.stem)
        key = keys[item.path] = stem.replace(".", "_") if webdataset else stem
        if webdataset:
            check_key(key, item.path)
        other = taken.setdefault((item.split, key), item.path)
        if other != item.path:
            raise DataError(f"{item.path}: would be {key}.h5, as {other.name}; expected another name")
    return keys


def _write(path: Path, parts: Iterable[bytes]) -> str:
    """Write and sync a file; its sha256."""
    digest = hashlib.sha256()
    with path.open("xb") as file:
        for part in parts:
            file.write(part)
            digest.update(part)
        file.flush()
        os.fsync(file.fileno())
    return digest.hexdigest()
