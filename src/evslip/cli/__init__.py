"""The command line: a function a verb, each of which calls one function of the library.

Begin with `VERBS`; `usage` understands words and explains mistakes; `options` makes options from settings.
A new verb is a function whose docstring is its help, and one line in VERBS.
"""

import ast
import contextlib
import importlib
import io
import os
import sys
from pathlib import Path

from evslip.cli.endings import Terminated, interrupts, line_of
from evslip.utils.errors import ConfigError, EvslipError
from evslip.utils.progress import shown
from evslip.utils.version import __version__

VERBS = {
    "demo": "demo",
    "show": "show",
    "generate": "dataset",
    "warm-up": "dataset",
    "status": "dataset",
    "verify": "dataset",
    "render": "look",
    "publish": "dataset",
    "windows": "windows",
    "train": "train",
    "sweep": "train",
    "evaluate": "detect",
    "report": "look",
    "events": "events",
    "calibrate": "sensor",
    "convert": "recordings",
    "import": "recordings",
    "info": "recordings",
    "realism": "sensor",
    "detect": "detect",
    "live": "events",
    "stream": "events",
    "control": "detect",
    "play": "look",
    "export": "detect",
    "view": "look",
    "video": "look",
    "rerun": "look",
    "label": "recordings",
    "label-agreement": "recordings",
    "doctor": "doctor",
}
"""File of each verb's function; it is imported when the verb is named, so that --help is quick."""

ENDLESS = ("view", "label", "play", "live", "stream")
"""Verbs that end when a person wants it: their progress is none of ours."""


def main() -> None:
    """Entry point. Errors of use: one line on stderr, exit code 2. Ctrl-C and SIGTERM: the same, exit codes 130 and
    143. Errors of evslip's own: one line that names a file with the details, exit code 1."""
    words = sys.argv[1:]
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # names of files may be any bytes
    try:
        with interrupts():
            if words[:1] in (["--version"], ["-V"]):
                print(f"evslip {__version__}")
            elif words[:1] in (["--help"], ["-h"]):
                print(overview())
            else:
                run(words)
    except EvslipError as error:
        sys.exit(_fail(str(error), 2))
    except KeyboardInterrupt as stop:
        sys.exit(_fail("stopped; what was finished is kept", 143 if isinstance(stop, Terminated) else 130))
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except MemoryError:
        sys.exit(_fail("the memory of this machine is too small for this", 2))
    except OSError as error:  # the file system has refused what nobody asked it for in particular
        about = f"{str(error.filename)[:200]}: " if error.filename else ""
        sys.exit(_fail(f"{about}{error.strerror or error}", 2))
    except Exception as error:
        sys.exit(_fail(line_of(error, words), 1))


def run(words: list[str]) -> None:
    """Do what the words of a command line say. Raises EvslipError."""
    if not words or words[0] not in VERBS:
        mistake = f"{words[0]!r} is no verb" if words else "no verb is named"
        raise ConfigError(f"{mistake}; expected one of {', '.join(VERBS)}; `evslip --help` explains")
    from evslip.cli.usage import understood

    verb, *rest = words
    with contextlib.nullcontext() if verb in ENDLESS else shown(verb):
        function = getattr(importlib.import_module(f"evslip.cli.{VERBS[verb]}"), function_of(verb))
        try:
            understood(function, verb, rest)()
        except ModuleNotFoundError as error:
            from evslip.cli.doctor import remedy

            raise remedy(error) from None


def function_of(verb: str) -> str:
    return "import_" if verb == "import" else verb.replace("-", "_")


def overview() -> str:
    """The verbs, each with the first line of its help."""
    texts: dict[str, str] = {}
    for file in sorted(set(VERBS.values())):
        for node in ast.parse(Path(__file__).with_name(f"{file}.py").read_text(encoding="utf-8")).body:
            if isinstance(node, ast.FunctionDef):
                texts[node.name] = (ast.get_docstring(node) or "").partition("\n")[0]
    lines = [f"  {verb:<17}{texts[function_of(verb)]}" for verb in VERBS]
    about = "Event-camera data for slip detection: generate, label, train, measure."
    return "\n".join(["usage: evslip VERB ...", "", about, "", *lines, "", "`evslip VERB --help` explains a verb."])


def _fail(message: str, code: int) -> int:
    line = f"evslip: {' '.join(message.split())}"
    print(line.encode("utf-8", "backslashreplace").decode(), file=sys.stderr)
    return code
