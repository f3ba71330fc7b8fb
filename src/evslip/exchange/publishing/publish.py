"""Writes a data set's publication: all of it, or nothing."""

import hashlib
import os
import shutil
import uuid
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from evslip.data.recordings import open_samples
from evslip.data.samples import Listing
from evslip.exchange.publishing.card import card
from evslip.exchange.publishing.croissant import croissant
from evslip.exchange.publishing.publication import Publication
from evslip.exchange.publishing.shards import Shards
from evslip.exchange.publishing.table import json_line, row
from evslip.utils import atomic
from evslip.utils.errors import DataError

RECORDINGS = "recordings"
"""Split of records that are in no split."""


def publish(
    source: str | Path, out: str | Path, how: Publication | None = None, progress: Callable[[], None] = lambda: None
) -> int:
    """Write the publication of a data set, a folder of records or one record to a new folder. Returns the number of
    samples.

    Equal samples give equal bytes. progress: called after each sample. Raises DataError, also for a record that has
    changed since it was written, ConfigError, StorageError.
    """
    how, out = how or Publication(), Path(out)
    if how.lerobot:
        from evslip.exchange.publishing.lerobot import publish_lerobot

        return publish_lerobot(source, out, how, progress)
    samples = open_samples(source)
    if not samples.listing:
        raise DataError(f"{source}: holds no finished sample")
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise DataError(f"{out}: is there already; expected a new folder")
    config = samples.config_toml
    name = how.name or Path(source).resolve().name
    temporary = out.with_name(f".{out.name}.{uuid.uuid4().hex[:8]}.tmp")
    try:
        with atomic.storage_errors(out):
            (temporary / "data").mkdir(parents=True)
            splits = _write_data(samples.listing, temporary / "data", how, progress)
            tables = {s: _write(temporary / f"{s}.jsonl", map(json_line, rows)) for s, rows in splits.items()}
            text = card(name, how.license, splits, config, how.webdataset, how.huggingface)
            _write(temporary / "README.md", [text.encode()])
            data = [
                (f"{split}-shards", "application/x-tar", f"data/{split}-*.tar")
                if how.webdataset
                else (f"{split}-records", "application/x-hdf5", f"data/{split}/*.h5")
                for split in splits
            ]
            about = text.split("\n\n")[1]
            licence = f"https://spdx.org/licenses/{how.license}"
            _write(temporary / "croissant.json", [croissant(name, about, licence, tables, data, how.metadata).encode()])
            if config:
                _write(temporary / "config.toml", [config.encode()])
            if out.exists():
                out.rmdir()
            temporary.rename(out)
            atomic.sync_folder(out.parent)
    except BaseException:
        shutil.rmtree(temporary, ignore_errors=True)
        raise
    return len(samples)


def _write_data(
    listing: Sequence[Listing], folder: Path, how: Publication, progress: Callable[[], None]
) -> dict[str, list[dict[str, Any]]]:
    """The table of each split; the records are written on the way."""
    splits: dict[str, list[dict[str, Any]]] = {item.split or RECORDINGS: [] for item in listing}
    keys = _keys(listing, how.webdataset)
    for split, rows in splits.items():
        shards = Shards(folder, split, round(how.shard_mb * 1e6))
        for item in listing:
            if (item.split or RECORDINGS) != split:
                continue
            key = keys[item.path]
            file = f"data/{shards.current}/{key}.h5" if how.webdataset else f"data/{split}/{key}.h5"
            values, data = row(item, file)
            if how.webdataset:
                shards.add(key, data, values)
            else:
                (folder / split).mkdir(exist_ok=True)
                _write(folder / split / f"{key}.h5", [data])
            rows.append(values)
            progress()
        shards.close()
    return splits


def _keys(listing: Sequence[Listing], webdataset: bool) -> dict[Path, str]:
    """Names of the records' files without suffix; in shards, whose readers take what follows the first dot for the
    suffix, without dots. Raises DataError for two of one name."""
    keys, taken = {}, {}
    for item in listing:
        key = keys[item.path] = item.path.stem.replace(".", "_") if webdataset else item.path.stem
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
