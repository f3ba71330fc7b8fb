"""Documents in JSON beside weights and figures: a format's name, its version, then the content."""

import json
import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from evslip.utils.errors import DataError
from evslip.utils.files import read_text
from evslip.utils.version import __version__

MOST_BYTES = 64 << 20


class Format(NamedTuple):
    """A kind of document."""

    name: str
    version: int
    meant: str
    """Description of such a file, for the error where another one is found."""

    def head(self) -> dict[str, Any]:
        """First entries of a document."""
        return {"format": self.name, "version": self.version, "evslip": __version__}


def read_document(path: Path, known: Format) -> dict[str, Any]:
    """The content of a file of a format, which its "format" names. Raises DataError."""
    if not path.exists():
        raise DataError(f"{path}: no such file; expected {known.meant}")
    try:
        content = json.loads(read_text(path, MOST_BYTES))
    except (ValueError, RecursionError) as error:
        raise DataError(f"{path}: cannot be read as JSON: {' '.join(str(error).split())[:100]}") from None
    named = content.get("format") if isinstance(content, dict) else None
    if named != known.name:
        raise DataError(f"{path}: not {known.meant}" + (f", but {named[:60]!r}" if isinstance(named, str) else ""))
    if content.get("version") != known.version:
        version = str(content.get("version"))[:60]
        raise DataError(f"{path}: version {version} of the format; this evslip reads version {known.version}")
    return content


def plain(value: Any) -> Any:
    """Dataclasses, arrays and tuples as what JSON knows; numbers that are not finite become None. The properties that a
    class names in DERIVED are written with its fields."""
    if is_dataclass(value) and not isinstance(value, type):
        names = (*(field.name for field in fields(value)), *getattr(value, "DERIVED", ()))
        return {name: plain(getattr(value, name)) for name in names}
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | list | tuple):
        return [plain(item) for item in (value.tolist() if isinstance(value, np.ndarray) else value)]
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    return value.item() if isinstance(value, np.generic) else value


def entry(content: Mapping[str, Any], name: str, kind: type, where: object) -> Any:
    """An entry of a document, or of a part of it, of a kind; a float may be written as a whole number. Raises DataError
    naming where it is and the key."""
    value = content.get(name)
    if isinstance(value, kind | (int if kind is float else kind)) and not isinstance(value, bool):
        return value
    found = "is missing" if name not in content else f"{str(value)[:60]!r} is wrong"
    raise DataError(f"{where}: {name}: {found}; expected {_KINDS.get(kind, kind.__name__)}")


_KINDS = {str: "a word", dict: "an object", float: "a number", int: "a whole number", list: "a list"}
