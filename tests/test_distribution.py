"""The check of what is to be released."""

import io
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "src" / "evslip"
FILES = {
    path.relative_to(ROOT / "src").as_posix(): path
    for path in PACKAGE.rglob("*")
    if path.is_file() and "__pycache__" not in path.parts
}
PRESET = "evslip/config/presets/simple.toml"
CACHED = "evslip/utils/__pycache__/jit.nbi"


def check(folder: Path, *, leave_out: str = "", add: str = "") -> subprocess.CompletedProcess:
    """What the check says of a wheel and a source distribution with all files but one, or one more."""
    names = [*(name for name in FILES if name != leave_out), *filter(None, [add]), "evslip-1.dist-info/LICENSE"]
    with zipfile.ZipFile(folder / "evslip-1-py3-none-any.whl", "w") as wheel:
        for name in names:
            wheel.writestr(name, "")
    with tarfile.open(folder / "evslip-1.tar.gz", "w:gz") as source:
        for name in names:
            source.addfile(tarfile.TarInfo(f"evslip-1/src/{name}"), io.BytesIO())
    command = [sys.executable, ROOT / "benchmarks" / "check_dist.py", folder]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_distributions_with_all_files_are_whole(tmp_path):
    done = check(tmp_path)
    assert done.returncode == 0, done.stdout
    assert done.stdout.count("whole") == 2


@pytest.mark.parametrize(
    ("change", "said"), [({"leave_out": PRESET}, f"lacks {PRESET}"), ({"add": CACHED}, f"has {CACHED}")]
)
def test_a_missing_file_and_one_that_was_left_are_told(tmp_path, change, said):
    done = check(tmp_path, **change)
    assert done.returncode == 1
    assert done.stdout.count(said) == 2


def test_no_distribution_is_told(tmp_path):
    done = subprocess.run(
        [sys.executable, ROOT / "benchmarks" / "check_dist.py", tmp_path], capture_output=True, text=True, check=False
    )
    assert (done.returncode, "expected one of each" in done.stdout) == (1, True)
