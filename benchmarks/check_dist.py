"""What is to be released, checked: benchmarks/check_dist.py [FOLDER], after `python -m build`; `make dist` does both.

FOLDER, by default dist, must hold one wheel and one source distribution of this version, each smaller than 10 MB. Both
must have every file of src/evslip, and nothing that a test, a cache or a compiler has left there. Exit code 1: no.
"""

import sys
import tarfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
MOST_BYTES = 10_000_000
LEFT = ("__pycache__", ".nbi", ".nbc", ".pyc", ".lock")


def wanted() -> set[str]:
    """Files of the package, from src on."""
    files = (path for path in (ROOT / "src" / "evslip").rglob("*") if path.is_file())
    return {name for path in files if not is_left(name := path.relative_to(ROOT / "src").as_posix())}


def is_left(name: str) -> bool:
    """Whether a file is not of the package."""
    return any(part in name for part in LEFT)


def contents(path: Path) -> set[str]:
    """Files in a distribution, those of the package named from src on."""
    if path.suffix == ".whl":
        return set(zipfile.ZipFile(path).namelist())
    with tarfile.open(path) as archive:
        names = [member.name.partition("/")[2] for member in archive.getmembers() if member.isfile()]
    return {name.removeprefix("src/") for name in names}


def faults(path: Path) -> list[str]:
    """What is wrong with a distribution."""
    found, size = contents(path), path.stat().st_size
    said = [f"{size:,} bytes; expected fewer than {MOST_BYTES:,}"] if size >= MOST_BYTES else []
    said += [f"lacks {name}" for name in sorted(wanted() - found)]
    said += [f"has {name}" for name in sorted(found) if is_left(name)]
    licence = any(name.endswith("LICENSE") for name in found)
    return said if licence else [*said, "lacks LICENSE"]


def main() -> int:
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "dist")
    wheels, sources = sorted(folder.glob("*.whl")), sorted(folder.glob("*.tar.gz"))
    if (len(wheels), len(sources)) != (1, 1):
        print(f"{folder}: {len(wheels)} wheels and {len(sources)} source distributions; expected one of each")
        return 1
    wrong = {path: faults(path) for path in (*wheels, *sources)}
    for path, said in wrong.items():
        print(f"{path}: {path.stat().st_size / 1e6:.2f} MB, {len(contents(path))} files: {'; '.join(said) or 'whole'}")
    return int(any(wrong.values()))


if __name__ == "__main__":
    sys.exit(main())
