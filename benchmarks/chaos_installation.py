"""Whole runs of `evslip generate demo`, train and test, where disks are full or the package may not be written.

The package is a copy that was compiled by whoever installed it. After a refusal what is there must be whole; run again
where there is room, or as a user without rights, the same records must come as from an undisturbed run.
"""

import hashlib
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from chaos_verbs import mounted, powerless

import evslip

SPLITS = (("train", 2), ("test", 1))
COMMAND = "from evslip.cli import main; main()"


class Run(NamedTuple):
    """How the commands of a whole run ended."""

    codes: list[int]
    lines: list[str]
    """What they said on stderr."""

    def is_refused(self) -> bool:
        """Whether the last said in one line, apart from notes, and with exit code 2 that the disk is full."""
        errors = [line for line in self.lines if "note: " not in line]
        full = ("no space left on the disk", "are free in")  # the latter before anything is made
        return self.codes[-1] == 2 and len(errors) == 1 and any(words in errors[0] for words in full)


def generated(package: Path, data: Path, splits=SPLITS, **options) -> Run:
    """Generate splits one after another, until one is refused."""
    codes: list[int] = []
    lines: list[str] = []
    environment = {**os.environ, "PYTHONPATH": str(package), **options.pop("variables", {})}
    for split, count in splits:
        words = ["generate", "demo", str(data), "--split", split, "--count", str(count)]
        command = [sys.executable, "-B", "-c", COMMAND, *words]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False, **options)
        codes.append(done.returncode)
        lines += done.stderr.splitlines() + [line for line in done.stdout.splitlines() if "note: " in line]
        if done.returncode:
            break
    return Run(codes, lines)


def records(data: Path) -> dict[str, str]:
    """Every record and its sum."""
    found = data.rglob("[0-9]*.h5")
    return {str(path.relative_to(data)): hashlib.sha256(path.read_bytes()).hexdigest() for path in found}


def left_over(data: Path) -> list[str]:
    """Files that have no name of their own."""
    return [path.name for path in data.rglob(".*") if path.is_file()]


def full(root: Path, count: int) -> tuple[bool, str]:
    """Disks with room for nothing, for next to nothing, and for random parts of what is written; then room is made."""
    with installed(root) as (package, whole, size):
        ends, wrong = [], []
        for room in (0, 20_000, *(random.randrange(size) for _ in range(count))):
            disk = root / "disk"
            with mounted(disk, f"size={size + 2**20}") as is_mounted:
                if not is_mounted:
                    return True, "no right to mount a tmpfs"
                free = os.statvfs(disk)
                with (disk / "filler").open("wb") as filler:
                    os.posix_fallocate(filler.fileno(), 0, max(1, free.f_bavail * free.f_frsize - room))
                run = generated(package, disk / "data")
                there = records(disk / "data")
                wrong += [] if run.is_refused() else [f"{room} bytes of room: {run}"]
                wrong += [f"{name} is hurt" for name in there if whole[name] != there[name]]
                wrong += [f"{name} is left" for name in left_over(disk / "data")]
                (disk / "filler").unlink()
                again = generated(package, disk / "data")
                problems = evslip.open_dataset(disk / "data").verify()
                if any(again.codes) or records(disk / "data") != whole or problems:
                    wrong.append(f"resumed: {again}, {problems}")
                ends.append(len(there))
        return not wrong, "; ".join(wrong[:3]) or (
            f"{len(ends)} full disks: exit code 2, one line, {sum(ends)} whole records and nothing else left; "
            "resumed with room: the undisturbed records"
        )


def no_room_for_compiled_code(root: Path, count: int) -> tuple[bool, str]:
    """The disk on which compiled code is kept is full: every process compiles, and the records are made."""
    with installed(root) as (package, whole, _):
        with mounted(root / "cache", "size=64k") as is_mounted:
            if not is_mounted:
                return True, "no right to mount a tmpfs"
            variables = {"NUMBA_CACHE_DIR": str(root / "cache")}
            run = generated(package, root / "data", (("test", 1),), variables=variables)
            left = [path.name for path in (root / "cache").rglob("*.tmp.*")]
        notes = [line for line in run.lines if "compiled code cannot be kept" in line]
        right = run.codes == [0] and len(run.lines) == len(notes) == 1 and not left
        right &= records(root / "data").items() <= whole.items()
        return right, (
            f"exit codes {run.codes}, {notes[0][:170]}...; the undisturbed record" if right else f"{run}, {left}"
        )


def read_only(root: Path, count: int) -> tuple[bool, str]:
    """A package that may not be written, for a user without rights: with a home, and without anything but the data."""
    with installed(root) as (package, whole, _):
        seen, wrong = [], []
        for name, is_home in (("with a home", True), ("without a home", False)):
            own = Path(tempfile.mkdtemp(dir=root))
            home = own if is_home else package
            variables = {"HOME": str(home), "NUMBA_CACHE_DIR": "", "XDG_CACHE_HOME": "", "EVSLIP_PROGRESS_S": "3600"}
            run = generated(package, own / "data", variables=variables, cwd=own, preexec_fn=powerless)
            compiled = len(list(own.rglob("*.nbc")))
            if run.codes != [0, 0] or run.lines or records(own / "data") != whole:
                wrong.append(f"{name}: {run}")
            seen.append(f"{name}: exit codes {run.codes}, {compiled} functions compiled")
        return not wrong, "; ".join(wrong or seen) + "; the undisturbed records" * (not wrong)


@contextmanager
def installed(root: Path) -> Iterator[tuple[Path, dict[str, str], int]]:
    """A read-only copy of the package, compiled, and what an undisturbed run makes: its records and their size."""
    root.mkdir(parents=True)
    package = root / "package"
    shutil.copytree(Path(evslip.__file__).parent, package / "evslip")
    run = generated(package, root / "undisturbed")
    if any(run.codes):
        sys.exit(f"an undisturbed run failed: {run}")
    folders = [package, *(path for path in package.rglob("*") if path.is_dir())]
    for folder in folders:
        folder.chmod(0o555)
    size = sum(path.stat().st_size for path in (root / "undisturbed").rglob("*") if path.is_file())
    try:
        yield package, records(root / "undisturbed"), size
    finally:
        for folder in folders:
            folder.chmod(0o755)


TRIALS = {
    "installed-full": full,
    "installed-cold": no_room_for_compiled_code,
    "installed-read-only": read_only,
}
