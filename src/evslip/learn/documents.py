"""What `evslip` keeps as JSON beside weights and figures: a format's name, its version, then the content."""

import json
from pathlib import Path
from typing import Any

from evslip.errors import DataError


def read_document(path: Path, name: str, version: int, *, missing: str, other: str) -> dict[str, Any]:
    """The content of a file of a format and version. missing: what a file that is not there was expected to be; other:
    what one of another format is not. Raises DataError."""
    try:
        content = json.loads(path.read_bytes())
    except FileNotFoundError:
        raise DataError(f"{path}: no such file; expected {missing}") from None
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: cannot be read as JSON: {' '.join(str(error).split())[:100]}") from None
    if not isinstance(content, dict) or content.get("format") != name:
        raise DataError(f"{path}: not {other}")
    if content.get("version") != version:
        raise DataError(f"{path}: version {content.get('version')} of the format; this evslip reads version {version}")
    return content
