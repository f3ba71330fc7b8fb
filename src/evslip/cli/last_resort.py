"""Errors that nobody foresaw: a line for the user, and a file that says all that a report needs."""

import platform
import shlex
import sys
import tempfile
import time
import traceback
from importlib import metadata
from pathlib import Path

from evslip.utils.version import __version__

ISSUES = "https://github.com/evslip/evslip/issues"
PACKAGES = ("numpy", "numba", "h5py", "mujoco", "pydantic", "tyro", "torch", "av", "pillow")


def line_of(error: Exception, words: list[str]) -> str:
    """One line about an error of evslip's own, whose details are then in a file of the system's temporary folder."""
    gist = f"{type(error).__name__}: {' '.join(str(error).split())[:160]}"
    path = Path(tempfile.gettempdir()) / f"evslip-crash-{time.strftime('%Y%m%d-%H%M%S')}-{time.time_ns() % 10**6}.txt"
    try:
        with path.open("x", encoding="utf-8", errors="backslashreplace") as file:
            file.write(report(error, words))
    except OSError:
        return f"an error of evslip's own, {gist}; please report the command at {ISSUES}"
    return f"an error of evslip's own, {gist}; please send {path} to {ISSUES}"


def report(error: Exception, words: list[str]) -> str:
    """The command, the versions and where it went wrong."""
    command = shlex.join(["evslip", *words])
    return "\n".join(
        [
            f"Please report this at {ISSUES}, with the files that the command reads if they may be seen.",
            "The text names files of yours: read it before you send it.",
            "",
            f"command: {command if len(command) < 4000 else command[:4000] + ' ...'}",
            f"evslip {__version__}, Python {sys.version.split()[0]}, {platform.platform()}",
            ", ".join(f"{name} {version}" for name in PACKAGES if (version := _version(name))),
            "",
            *traceback.format_exception(error),
        ]
    )


def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None
