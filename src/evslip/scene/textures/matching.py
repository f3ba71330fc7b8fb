"""Files of a folder, or that a pattern of paths matches, among so many entries of folders at most."""

import os
from collections.abc import Iterator
from fnmatch import fnmatchcase
from pathlib import Path

from evslip.utils.errors import ConfigError

MOST_ENTRIES = 100_000
"""Entries of folders that are looked at for one pattern."""


def files_in(folder: Path) -> list[str]:
    """Paths of a folder's entries. Raises ConfigError for too many."""
    return [entry.path for entry in _Budget(str(folder)).entries(folder)]


def matching_files(pattern: str) -> list[str]:
    """Paths that a pattern matches. "**" stands for any folders, or none; "*", "?" and "[abc]" for what is within a
    name, but for no dot at its begin. Raises ConfigError where there is too much to look through."""
    path = Path(pattern)
    parts = path.parts[1:] if path.anchor else path.parts
    return [str(found) for found in set(_matching(Path(path.anchor), parts, _Budget(pattern)))]


class _Budget:
    def __init__(self, pattern: str):
        self._pattern, self._left = pattern, MOST_ENTRIES

    def entries(self, folder: Path) -> Iterator[os.DirEntry[str]]:
        """Entries of a folder; none of what is no folder, or may not be read."""
        try:
            with os.scandir(folder) as found:
                for entry in found:
                    self._left -= 1
                    if self._left < 0:
                        raise ConfigError(
                            f"texture: {self._pattern!r}: more than {MOST_ENTRIES:,} files and folders to look "
                            "through; expected a folder of fewer"
                        )
                    yield entry
        except (OSError, ValueError):
            return


def _matching(folder: Path, parts: tuple[str, ...], budget: _Budget) -> Iterator[Path]:
    part, rest = parts[0], parts[1:]
    if part == "**":
        yield from _matching(folder, rest or ("*",), budget)
        for entry in budget.entries(folder):
            if not entry.name.startswith(".") and entry.is_dir(follow_symlinks=False):
                yield from _matching(folder / entry.name, parts, budget)
        return
    if any(sign in part for sign in "*?["):
        dotted = part.startswith(".")
        names = [e.name for e in budget.entries(folder) if dotted or not e.name.startswith(".")]
        found = [folder / name for name in names if fnmatchcase(name, part)]
    else:
        found = [folder / part] if (folder / part).exists() else []
    for inner in found:
        if rest:
            yield from _matching(inner, rest, budget)
        else:
            yield inner
