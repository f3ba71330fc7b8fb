"""What is said on the command line, understood; a mistake there takes one line, like every other."""

import contextlib
import functools
import io
import re
from collections.abc import Callable
from typing import Any

import tyro

from evslip.utils.errors import ConfigError

_RULE = re.compile(r"[\s│╭╰╮╯]*[-─]{4,}[\s│╭╰╮╯]*")


def chosen(verbs: dict[str, Callable[..., None]], description: str) -> Callable[[], None]:
    """The verb that sys.argv names, with its arguments. Raises ConfigError; --help prints and exits."""
    complaint = io.StringIO()
    try:
        with contextlib.redirect_stderr(complaint):
            deferred = {name: _deferred(verb) for name, verb in verbs.items()}
            return tyro.extras.subcommand_cli_from_dict(deferred, prog="evslip", description=description)
    except SystemExit as stopped:
        if not stopped.code:
            raise
        raise ConfigError(_in_one_line(complaint.getvalue())) from None


def _deferred(verb: Callable[..., None]) -> Callable[..., Any]:
    @functools.wraps(verb)
    def later(*arguments: Any, **options: Any) -> Callable[[], None]:
        return functools.partial(verb, *arguments, **options)

    return later


def _in_one_line(box: str) -> str:
    """The gist of what tyro prints in a box: a title, a rule, the message, a rule, help."""
    title, *rest = [line.strip(" │╭╮╰╯─") for line in box.splitlines() if line.strip()]
    message: list[str] = []
    for line in rest:
        if _RULE.fullmatch(line) or not line:
            if message:
                break
            continue
        message.append(line)
    text = " ".join(message).split(" Got errors:")[0] or title
    text = re.sub(r"no type matching \S*{(\w+(?: \w+)+)} could be instantiated from \[(.*)\]", r"\2 is not \1", text)
    text = re.sub(r"no type matching \S+ could be instantiated from \[(.*)\]", r"\1 is not a number", text)
    return f"{text.removesuffix('.')}; `evslip VERB --help` explains"
