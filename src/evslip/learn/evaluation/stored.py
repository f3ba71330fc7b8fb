"""An evaluation as a file: what `evslip evaluate` and `evslip demo` write, and a report reads."""

import json
from collections.abc import Sequence
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np

from evslip.learn.documents import Format, plain, read_document
from evslip.learn.evaluation.comparison import compare
from evslip.learn.evaluation.evaluation import Evaluation
from evslip.utils import atomic
from evslip.utils.errors import DataError

FILE = "evaluation.json"
FORMAT = Format("evslip evaluation", 1, "an evaluation that `evslip evaluate` wrote")


def save_evaluation(path: Path, found: Sequence[Evaluation]) -> None:
    """Everything, as numbers; what is not defined, or not reached as slips are missed, is null. Raises StorageError."""
    content = FORMAT.head() | {"models": plain(list(found)), "comparison": plain(compare(found))}
    atomic.write_text(path, json.dumps(content, indent=1, allow_nan=False) + "\n")


def read_evaluation(path: str | Path) -> list[Evaluation]:
    """The evaluations in a file evaluation.json, one a model. Raises DataError."""
    path = Path(path)
    stored = read_document(path, FORMAT)
    try:
        if not stored["models"]:
            raise ValueError("no model")
        found = restored(list[Evaluation], stored["models"])
        if any(np.shape(one.scores.confusion) != (2, 2) for one in found):
            raise ValueError("confusion: expected 2 rows of 2 counts")
        return found
    except KeyError as error:
        raise DataError(f"{path}: {str(error)[:60]} is missing; evaluate again") from None
    except (TypeError, ValueError, ArithmeticError, AttributeError, RecursionError) as error:
        raise DataError(f"{path}: damaged: {' '.join(str(error).split())[:100]}; evaluate again") from None


def restored(kind: Any, value: Any) -> Any:
    """The inverse of `plain` for a type: null is nan where a number is wanted, and inf in an array (a slip
    that was missed). Raises KeyError, TypeError, ValueError."""
    if get_origin(kind) in (Union, UnionType):
        return None if value is None else restored(next(k for k in get_args(kind) if k is not NoneType), value)
    if kind is float:
        return float("nan") if value is None else float(value)
    if kind is np.ndarray:
        return np.array([np.inf if item is None else item for item in value], float)
    if is_dataclass(kind) and isinstance(kind, type):
        hints = get_type_hints(kind)
        there = [f for f in fields(kind) if f.name in value or f.default is MISSING]  # files from before lack some
        return kind(**{f.name: restored(hints[f.name], value[f.name]) for f in there})
    inner = get_args(kind)
    if get_origin(kind) is list:
        return [restored(inner[0], item) for item in value]
    if get_origin(kind) is dict:
        return {key: restored(inner[1], item) for key, item in value.items()}
    if get_origin(kind) is tuple:
        kinds = [inner[0]] * len(value) if len(inner) == 2 and inner[1] is Ellipsis else inner
        return tuple(restored(k, item) for k, item in zip(kinds, value, strict=True))
    return value
