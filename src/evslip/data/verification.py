"""Whether a data set's files are what was written: every byte against the journals."""

from collections.abc import Callable
from pathlib import Path

from evslip.data import requested
from evslip.data.journal import read_journals
from evslip.data.layout import JOURNAL, SAMPLES, is_temporary, sample_path, sha256_of
from evslip.utils.progress import over
from evslip.utils.seeds import SPLITS


def find_problems(root: Path, splits: tuple[str, ...], progress: Callable[[int, int], None] | None = None) -> list[str]:
    """Problems of some splits; see `dataset.Dataset.verify`."""
    entries, problems = read_journals(root / JOURNAL)
    begun = {split for split, _ in entries}
    lines = [line for split in splits for line in requested.problems(root, split, split in begun)]
    problems += dict.fromkeys(lines)
    expected = {sample_path(root, *key): wanted for key, wanted in entries.items() if key[0] in splits}
    samples = root / SAMPLES
    # A split may be a link to another disk, and links are followed only where a search begins.
    linked = (path for path in samples.glob("*") if path.is_symlink() and path.is_dir())
    folders = [samples, *linked] if splits == SPLITS else [samples / split for split in splits]
    present = sorted(path for folder in folders for path in folder.rglob("*") if not path.is_dir())
    problems += [f"{path}: missing" for path in sorted(expected.keys() - set(present))]
    kept = [path for path in sorted((root / JOURNAL).rglob("*")) if not path.is_dir()]
    left = filter(is_temporary, [*sorted(root.glob(".*.tmp")), *kept])
    problems += [f"{path}: a temporary file left behind" for path in left]
    problems += [f"{p}: surplus, not a journal" for p in kept if p.suffix != ".jsonl" and not is_temporary(p)]
    for done, path in enumerate(over("files", present), 1):
        if is_temporary(path):
            problems.append(f"{path}: a temporary file left behind")
        elif path not in expected:
            problems.append(f"{path}: surplus, no journal knows it")
        elif sha256_of(path) not in {entry["sha256"] for entry in expected[path]}:
            problems.append(f"{path}: damaged, its sha256 is not the one it was written with")
        if progress:
            progress(done, len(present))
    return problems
