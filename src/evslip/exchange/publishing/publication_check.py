"""Whether a publication is what was written: the tables against croissant.json, every record against its table."""

import hashlib
import json
import tarfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from evslip.data.layout import JOURNAL, sha256_of
from evslip.exchange.publishing.croissant import METADATA
from evslip.utils.errors import DataError
from evslip.utils.files import read_text, require_file
from evslip.utils.progress import over

MOST_BYTES = 16 << 20


def is_publication(root: Path) -> bool:
    """Whether it is the folder of a publication, other than one for robot learning; also one without its metadata."""
    has_tables = (root / "data").is_dir() and any(root.glob("*.jsonl"))
    return ((root / METADATA).is_file() or has_tables) and not (root / JOURNAL).is_dir()


def find_problems(root: Path) -> list[str]:
    """One line a problem: tables and records that are damaged or missing, and files that no table lists. Raises
    DataError for metadata that are damaged."""
    expected, problems, tables = {}, [], dict[str, str | None]()
    if (root / METADATA).is_file():
        tables |= _tables(root / METADATA)
    else:  # nobody vouches for the tables, yet they tell more than nothing
        problems.append(f"{root / METADATA}: missing")
        tables |= {path.name: None for path in sorted(root.glob("*.jsonl"))}
    for name, digest in tables.items():
        table = root / name
        if digest is None or sha256_of(table) == digest:
            expected |= _listed(table)
        elif table.exists():
            problems.append(f"{table}: damaged, its sha256 is not that in {METADATA}")
        else:
            problems.append(f"{table}: missing")
    present: dict[str, str | None] = {}
    for path in over("files", sorted(path for path in (root / "data").rglob("*") if not path.is_dir())):
        present |= _content(path, str(path.relative_to(root)))
    for name in sorted(expected.keys() | present.keys()):
        if name not in present:
            problems.append(f"{root / name}: missing")
        elif name not in expected:
            problems.append(f"{root / name}: surplus, no table lists it")
        elif present[name] != expected[name]:
            problems.append(f"{root / name}: damaged, its sha256 is not the one that its table lists")
    return problems


def _tables(metadata: Path) -> dict[str, str]:
    """The sha256 of each table by its name."""
    try:
        parts = json.loads(read_text(metadata, MOST_BYTES))["distribution"]
        return {str(part["contentUrl"]): part["sha256"] for part in parts if "sha256" in part}
    except (ValueError, KeyError, TypeError, RecursionError):
        raise DataError(f"{metadata}: damaged, not the metadata that `evslip publish` writes") from None


def _listed(table: Path) -> dict[str, str]:
    """The sha256 of each file that a table lists; in a shard the row itself lies beside its record."""
    listed = {}
    try:
        with table.open("rb") as lines:
            for line in lines:
                row = json.loads(line)
                file = str(row["file"])
                listed[file] = row["sha256"]
                if ".tar/" in file:
                    listed[file.removesuffix(".h5") + ".json"] = hashlib.sha256(line.rstrip(b"\n")).hexdigest()
    except (ValueError, KeyError, TypeError, RecursionError):
        raise DataError(f"{table}: not a table that `evslip publish` writes, a row a sample") from None
    return listed


def _content(path: Path, name: str) -> Iterator[tuple[str, str | None]]:
    """Name and sha256 of a file, or of each in a shard; None for what cannot be read."""
    if path.suffix != ".tar":
        yield name, sha256_of(path)
        return
    try:
        with tarfile.open(require_file(path), "r:") as shard:
            for member in shard:
                content: Any = shard.extractfile(member)
                digest = None if content is None else hashlib.file_digest(content, "sha256").hexdigest()
                yield f"{name}/{member.name}", digest
    except (OSError, tarfile.TarError, DataError):
        return  # what could not be reached is missing
