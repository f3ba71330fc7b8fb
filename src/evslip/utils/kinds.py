"""Values against the types of a dataclass's fields: whole numbers, numbers, truths and words."""

import math
from typing import Any

KINDS: dict[Any, str] = {int: "a whole number", float: "a finite number", bool: "true or false"}
"""What a type stands for; any other is a word."""
MOST = 2**65
"""Greater whole numbers are none that a setting can mean, and too large for arithmetic with floats."""


def plain(value: Any) -> Any:
    """A number or truth of NumPy's as one of Python's."""
    return value.item() if getattr(value, "shape", None) == () else value


def suits(value: Any, kind: Any) -> bool:
    """Whether a value may be in a field of a type: whole numbers are numbers; truths and infinity are not."""
    if kind is bool or isinstance(value, bool):
        return kind is bool and isinstance(value, bool)
    if kind not in (int, float):
        return isinstance(value, str)
    return isinstance(value, kind | int) and abs(value) < (math.inf if isinstance(value, float) else MOST)
