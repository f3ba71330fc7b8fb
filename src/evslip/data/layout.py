"""The files of a data set. What is in it is known from them alone, so any run can take up where another was killed.

config.toml                         what the samples are drawn from
plan-{split}.json                   how many samples were asked for, and the sha256 of config.toml
samples/{split}/000/0000007.h5      records, a thousand a folder
journal/{00..ff}/*.jsonl            name, size and sha256 of every finished record
"""

import hashlib
import os
import re
from pathlib import Path

from evslip.utils.errors import DataError
from evslip.utils.files import require_file
from evslip.utils.seeds import SPLITS

CONFIG, SAMPLES, JOURNAL = "config.toml", "samples", "journal"
_TEMPORARY = re.compile(r"\..+\.[0-9a-f]{8}\.tmp")


def sample_path(root: Path, split: str, index: int) -> Path:
    """Path of a sample's record."""
    return root / SAMPLES / split / f"{index // 1000:03d}" / f"{index:07d}.h5"


def plan_path(root: Path, split: str) -> Path:
    """File with the number of samples that a split was asked for."""
    return root / f"plan-{split}.json"


def require_not_own(path: Path, root: Path, is_folder: bool = False) -> None:
    """Raise DataError where a file to write would lie among those that a data set keeps for itself, or many of a folder
    beside them."""
    place, home = (Path(os.path.realpath(one)) for one in (path, root))
    if is_folder and place == home and (home / CONFIG).is_file():
        raise DataError(f"{path}: is the data set's own folder; expected a new one, which may lie in it")
    if not (home / CONFIG).is_file() or home not in place.parents:
        return
    first = place.relative_to(home).parts[0]
    if first in (CONFIG, SAMPLES, JOURNAL) or first in {plan_path(home, split).name for split in SPLITS}:
        raise DataError(f"{path}: would lie among the data set's own files; give the new one another place")


def is_temporary(path: Path) -> bool:
    """Whether a file is one that `atomic` writes before it gets its name."""
    return _TEMPORARY.fullmatch(path.name) is not None


def sweep(path: Path) -> None:
    """Remove temporary files that killed writers of this path left beside it."""
    for left in path.parent.glob(f".*{path.name}.*.tmp"):
        left.unlink(missing_ok=True)


def sha256_of(path: Path) -> str | None:
    """Sum of a file's content, in hexadecimal; None if it cannot be read."""
    try:
        with require_file(path).open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except (OSError, DataError):
        return None
