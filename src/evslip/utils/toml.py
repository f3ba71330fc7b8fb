"""TOML texts from outside, which may be of any size and nested to any depth."""

import re
import tomllib
from pathlib import Path
from typing import Any

from evslip.utils.files import read_text

MOST_BYTES = 4 << 20
MOST_PARTS = 50
"""Parts of a dotted key; the time to read one grows with their square."""
_BETWEEN_KEYS = re.compile(r"[=,{}\[\]\n]")


def read_toml(path: str | Path) -> dict[str, Any]:
    """Content of a file. Raises DataError for one that cannot be read, ValueError, of one line, for one that is no
    TOML."""
    return parse_toml(read_text(path, MOST_BYTES))


def parse_toml(text: str) -> dict[str, Any]:
    """Content of a text. Raises ValueError, of one line."""
    if any(part.count(".") > MOST_PARTS for part in _BETWEEN_KEYS.split(text)):
        raise ValueError(f"a key of more than {MOST_PARTS} parts")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("nested too deep") from None
    except tomllib.TOMLDecodeError as error:
        raise ValueError(str(error)) from None
    except ValueError:  # of a number of thousands of digits
        raise ValueError("a number of too many digits") from None
