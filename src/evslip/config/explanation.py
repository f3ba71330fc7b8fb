"""Explanation, in words, of what is wrong with values from outside."""

from difflib import get_close_matches
from typing import Any, get_args

from pydantic import BaseModel, RootModel, ValidationError


def explain(error: ValidationError, model: type) -> str:
    """The first thing that is wrong, in one line that begins with the dotted key."""
    problem = error.errors(include_url=False)[0]
    path = [str(part) for part in problem["loc"]]
    message, given = problem["msg"].removeprefix("Value error, "), problem.get("input")
    if problem["type"] == "within":
        field, _, message = message.partition("|")
        return f"{'.'.join([*path, field])}: {message}"
    key = ".".join(path)
    if problem["type"] == "extra_forbidden":
        siblings = _fields(model, path[:-1])
        close = get_close_matches(path[-1], siblings, 1, 0.5)
        hint = f"did you mean {close[0]}?" if close else f"expected one of {', '.join(siblings)}"
        return f"{key}: unknown key; {hint}"
    if problem["type"] == "missing":
        return f"{key}: this key is missing"
    if problem["type"] == "model_type":
        return f"{key}: {_short(given)} is wrong: expected a section of keys"
    if isinstance(given, dict) and problem["type"] != "value_error":
        return f"{key}: {message}"
    return f"{key}: {_short(given)} is wrong: {message}"


def _fields(model: Any, path: list[str]) -> list[str]:
    for part in path:
        if not part.isdigit():
            model = _model(model.model_fields[part].annotation)
    return list(model.model_fields)


def _model(annotation: Any) -> Any:
    """The model in an annotation; of a list of models their entries'."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return _model(annotation.model_fields["root"].annotation) if issubclass(annotation, RootModel) else annotation
    return next((found for part in get_args(annotation) if (found := _model(part))), None)


def _short(value: Any) -> str:
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # of thousands of digits, or nested as deep
        text = f"a {type(value).__name__} too long to print"
    return text if len(text) <= 60 else text[:57] + "..."
