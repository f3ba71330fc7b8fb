"""Words of the command line, understood by tyro; a mistake there takes one line, like every other."""

import contextlib
import functools
import inspect
import re
from collections.abc import Callable, Sequence
from itertools import takewhile
from typing import Annotated, Any

import tyro
from tyro.conf import DisallowNone, OmitArgPrefixes, PositionalMetavarFromFieldName

from evslip.cli.options import SILENT
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

    del later.__wrapped__  # which tyro would explain in place of this
    later.__doc__ = _unbroken(verb.__doc__ or "")
    later.__dict__["__signature__"] = signature = inspect.signature(verb)
    later.__annotations__ = _with_silent_defaults(signature)

    def refuse(mistake: Any) -> None:
        raise _MistakeError(mistake)

    def parsed(words: Sequence[str]) -> Callable[[], None]:
        with mistakes.on_parse_error(refuse) if mistakes else contextlib.nullcontext():
            return tyro.cli(later, prog=f"evslip {name}", args=words, config=CONFIG)

    words = _with_sides_apart(words)
    try:
        return parsed(words)
    except _MistakeError as error:
        # An unknown option is taken for a word that is missing; alone on the line, every one of them is.
        unknown = [word for word in words if word.startswith("--") and word != "--help" and _is_unknown(parsed, word)]
        reason = f"{' '.join(unknown)}: not known here" if unknown else _explained(error.args[0], words)
        raise ConfigError(f"{reason}; `evslip {name} --help` explains") from None


def _with_silent_defaults(signature: inspect.Signature) -> dict[str, Any]:
    """Annotations of a signature, whose help says nothing of what is None, or not there, by default."""

    def is_silent(one: inspect.Parameter) -> bool:
        return one.default in (None, ()) or (one.default is one.empty and one.kind is not one.KEYWORD_ONLY)

    return {
        name: Annotated[one.annotation, SILENT] if is_silent(one) else one.annotation
        for name, one in signature.parameters.items()
    }


def _unbroken(docstring: str) -> str:
    """A docstring whose explanations of arguments have a line each: tyro would keep their breaks."""
    return re.sub(r"\n {8,}(?=\S)", " ", inspect.cleandoc(docstring))


def _with_sides_apart(words: Sequence[str]) -> list[str]:
    """A size such as 1730x1300 as the two numbers that it is."""
    apart: list[str] = []
    for word in words:
        option, _, value = word.rpartition("=")
        is_size = option == "--size" or (not option and apart[-1:] == ["--size"])
        sides = re.fullmatch(r"(\d+)[xX](\d+)", value) if is_size else None
        apart += [*([option] if option else []), *sides.groups()] if sides else [word]
    return apart


class _MistakeError(Exception):
    """Raised with a mistake, as tyro tells it."""


def _is_unknown(parsed: Callable[[Sequence[str]], Any], option: str) -> bool:
    try:
        parsed([option])
    except _MistakeError as error:
        (mistake,) = error.args
        left_over = [*getattr(mistake, "tokens", ()), *getattr(mistake, "unrecognized_tokens", ())]
        argument = getattr(mistake, "argument", None)
        return bool(left_over) or (argument is not None and argument.is_positional())
    return False


def _explained(mistake: Any, words: Sequence[str]) -> str:
    """Gist of a mistake of use, in one line."""
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
    """Kind of value that an argument takes, as help has it."""
    return str(argument.lowered.metavar).strip("{}")


def _given(option: str, words: Sequence[str]) -> str:
    """Words that follow an option on the command line."""
    for place, word in enumerate(words):
        name, equals, value = word.partition("=")
        if name.replace("_", "-") == option:
            following = [value] if equals else [*takewhile(lambda word: not word.startswith("--"), words[place + 1 :])]
            return repr(" ".join(following)) if following else "nothing"
    return "nothing"
