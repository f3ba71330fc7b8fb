"""Words of the command line, understood by tyro; a mistake there takes one line, like every other."""

import contextlib
import functools
from collections.abc import Callable, Sequence
from itertools import takewhile
from typing import Any

import tyro
from tyro.conf import DisallowNone, OmitArgPrefixes, PositionalMetavarFromFieldName

from evslip.utils.errors import ConfigError

try:
    from tyro import _errors as mistakes
except ImportError:  # private, though nothing else tells of a mistake in parts: without it tyro prints its boxes
    mistakes: Any = None

_PLAIN = {"INT": "a whole number", "FLOAT": "a number", "NUMBER": "a number"}
CONFIG = (DisallowNone, OmitArgPrefixes, PositionalMetavarFromFieldName)


def understood(verb: Callable[..., None], name: str, words: Sequence[str]) -> Callable[[], None]:
    """The verb with the arguments that `words` give. Raises ConfigError; --help prints and exits."""

    @functools.wraps(verb)
    def later(*arguments: Any, **options: Any) -> Callable[[], None]:
        return functools.partial(verb, *arguments, **options)

    def refuse(mistake: Any) -> None:
        raise ConfigError(f"{_told(mistake, words)}; `evslip {name} --help` explains")

    with mistakes.on_parse_error(refuse) if mistakes else contextlib.nullcontext():
        return tyro.cli(later, prog=f"evslip {name}", args=words, config=CONFIG)


def _told(mistake: Any, words: Sequence[str]) -> str:
    """The gist of a mistake of use, in one line."""
    kind, argument = type(mistake).__name__, getattr(mistake, "argument", None)
    if kind == "MissingArgs":
        missing = [(one.arg.is_positional(), one.arg) for one in mistake.missing_arguments]
        names = [_kind(arg) if by_place else f"{arg.display_name()} {_kind(arg)}" for by_place, arg in missing]
        return f"missing: {', '.join(names)}"
    if kind == "UnrecognizedArgs":
        return f"{' '.join(mistake.tokens)}: not known here"
    if argument is None:
        return str(getattr(mistake, "message", kind))
    name, wanted = argument.display_name(), _kind(argument)
    if kind == "InvalidChoice":
        return f"{name}: {mistake.value!r} is unknown; expected one of {wanted.replace(',', ', ')}"
    return f"{name}: {_given(name, words)} given, expected {_PLAIN.get(wanted, wanted)}"


def _kind(argument: Any) -> str:
    """What an argument takes, as help has it."""
    return str(argument.lowered.metavar).strip("{}")


def _given(option: str, words: Sequence[str]) -> str:
    """What follows an option on the command line."""
    for place, word in enumerate(words):
        name, equals, value = word.partition("=")
        if name.replace("_", "-") == option:
            following = [value] if equals else [*takewhile(lambda word: not word.startswith("--"), words[place + 1 :])]
            return repr(" ".join(following)) if following else "nothing"
    return "nothing"
