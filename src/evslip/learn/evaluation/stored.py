"""Reading an examination again that `evslip evaluate` has written."""

from dataclasses import fields, is_dataclass
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np

from evslip.learn.documents import Format, read_document
from evslip.learn.evaluation.evaluation import Evaluation
from evslip.learn.scores.metrics import FORMAT as SCORES
from evslip.learn.scores.metrics import Metrics
from evslip.utils.errors import DataError

FILE = "evaluation.json"
FORMAT = Format("evslip evaluation", 1, "an evaluation that `evslip evaluate` wrote")


def read_evaluation(path: str | Path) -> list[Evaluation] | Metrics:
    """The evaluations in a file evaluation.json, or the scores alone that `Metrics.save` wrote. Raises DataError."""
    path = Path(path)
    stored = read_document(path, FORMAT, SCORES)
    try:
        if stored["format"] == SCORES.name:
            return restored(Metrics, stored)
        if not stored["models"]:
            raise ValueError("no model")
        return restored(list[Evaluation], stored["models"])
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise DataError(f"{path}: damaged: {' '.join(str(error).split())[:100]}; evaluate again") from None


def restored(kind: Any, value: Any) -> Any:
    """The inverse of `evaluation.plain` for a type: null is nan where a number is wanted, and inf in an array (a slip
    that was missed). Raises KeyError, TypeError, ValueError."""
    if get_origin(kind) in (Union, UnionType):
        return None if value is None else restored(next(k for k in get_args(kind) if k is not NoneType), value)
    if kind is float:
        return float("nan") if value is None else float(value)
    if kind is np.ndarray:
        return np.array([np.inf if item is None else item for item in value], float)
    if is_dataclass(kind) and isinstance(kind, type):
        hints = get_type_hints(kind)
        return kind(**{f.name: restored(hints[f.name], value[f.name]) for f in fields(kind)})
    inner = get_args(kind)
    if get_origin(kind) is list:
        return [restored(inner[0], item) for item in value]
    if get_origin(kind) is dict:
        return {key: restored(inner[1], item) for key, item in value.items()}
    if get_origin(kind) is tuple:
        kinds = [inner[0]] * len(value) if len(inner) == 2 and inner[1] is Ellipsis else inner
        return tuple(restored(k, item) for k, item in zip(kinds, value, strict=True))
    return value
