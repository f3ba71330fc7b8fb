"""What `evslip` keeps as JSON beside weights and figures: a format's name, its version, then the content."""

import json
from pathlib import Path
from typing import Any, NamedTuple

from evslip.utils.errors import DataError
from evslip.utils.version import __version__


class Format(NamedTuple):
    """A kind of document."""

    name: str
    version: int
    meant: str
    """What a file of it is, to be told where another one is found."""

    def head(self) -> dict[str, Any]:
        """What a document of it begins with."""
        return {"format": self.name, "version": self.version, "evslip": __version__}


def read_document(path: Path, *formats: Format) -> dict[str, Any]:
    """The content of a file of one of some formats, which its "format" names. Raises DataError."""
    meant = " or ".join(known.meant for known in formats)
    try:
        content = json.loads(path.read_bytes())
    except FileNotFoundError:
        raise DataError(f"{path}: no such file; expected {meant}") from None
    except (OSError, ValueError, RecursionError) as error:
        raise DataError(f"{path}: cannot be read as JSON: {' '.join(str(error).split())[:100]}") from None
    named = content.get("format") if isinstance(content, dict) else None
    known = next((known for known in formats if known.name == named), None)
    if known is None:
        raise DataError(f"{path}: not {meant}")
    if content.get("version") != known.version:
        raise DataError(
            f"{path}: version {content.get('version')} of the format; this evslip reads version {known.version}"
        )
    return content
