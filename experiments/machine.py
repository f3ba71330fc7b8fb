"""What the experiment ran on."""

import os
import platform
import subprocess
from collections.abc import Sequence
from datetime import date
from importlib import metadata
from pathlib import Path
from typing import Any

PACKAGES = ("evslip", "numpy", "numba", "mujoco", "torch", "mitsuba")


def facts() -> dict[str, Any]:
    """Processor, cores, memory, versions, the source's commit, the day. None of it names the machine."""
    return {
        "date": date.today().isoformat(),
        "processor": _processor(),
        "cores": len(os.sched_getaffinity(0)),
        "memory_gib": round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "commit": _commit(),
        "versions": {name: version for name in PACKAGES if (version := _version(name))},
    }


def describe(runs: Sequence[dict[str, Any]]) -> list[str]:
    """A line for each machine with its software, and when which commits ran on it."""
    commits: dict[str, list[str]] = {}
    for known in runs:
        versions = ", ".join(f"{name} {version}" for name, version in known["versions"].items())
        machine = (
            f"{known['processor']}, {known['cores']} cores, {known['memory_gib']} GiB, {known['system']}; "
            f"Python {known['python']}, {versions}"
        )
        commits.setdefault(machine, []).append(f"{known['commit']} ({known['date']})")
    return [f"{machine}; commit {', '.join(when)}" for machine, when in commits.items()]


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or "processor unknown"


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _commit() -> str:
    def git(*words: str) -> str:
        command = ["git", "-C", str(Path(__file__).parent), *words]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()

    try:
        return git("rev-parse", "--short=12", "HEAD") + (" and changes" if git("status", "--porcelain") else "")
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
