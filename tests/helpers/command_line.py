"""The command line within the tests' own process: a process for each command imports the package anew each time."""

import contextlib
import io
import sys
from typing import NamedTuple
from unittest import mock

from evslip.cli import main


class Done(NamedTuple):
    """How a command ended."""

    returncode: int
    stdout: str
    stderr: str


def evslip(*words: object) -> Done:
    """Run `evslip WORDS`."""
    out, err, code = io.StringIO(), io.StringIO(), 0
    arguments = mock.patch.object(sys, "argv", ["evslip", *map(str, words)])
    with arguments, contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            main()
        except SystemExit as stop:
            code = int(stop.code or 0)
    return Done(code, out.getvalue(), err.getvalue())
