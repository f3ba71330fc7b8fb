import resource
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import numba
import numpy as np
import pytest

import evslip
from evslip.utils.jit import fused
from permissions import powerless


def package_in(home: Path) -> Path:
    """A package of three rooms with evslip's decorator."""
    package = home / "evslip"
    for folder in (package, *(package / room for room in ("utils", "kitchen", "cellar"))):
        folder.mkdir()
        (folder / "__init__.py").touch()
    shutil.copy(Path(evslip.__file__).parent / "utils" / "jit.py", package / "utils")
    return package


@pytest.fixture
def package(tmp_path) -> Path:
    return package_in(tmp_path)


@pytest.fixture(scope="module")
def kept(tmp_path_factory) -> Path:
    """A package whose code is compiled and kept."""
    package = package_in(tmp_path_factory.mktemp("kept"))
    (package / "kitchen" / "outer.py").write_text(KITCHEN.format(1))
    assert [run(package, COUNT) for _ in range(2)] == [2 + COMPILED, 2]
    return package


KITCHEN = """
from evslip.utils.jit import Listener, compiled
@compiled()
def f(x):
    return x + {}
compilations = []
Listener(after=compilations.append)
"""
COUNT = "from evslip.kitchen.outer import f, compilations; print(f(1.0) + 100 * len(compilations))"
COMPILED = 100
"""A compilation adds as much to what `COUNT` prints."""


def run(package: Path, code: str = "from evslip.kitchen.outer import f; print(f(1.0))", **options) -> float:
    done = ended(package, code, **options)
    assert done.returncode == 0 and not done.stderr, done.stderr
    return float(done.stdout)


def ended(package: Path, code: str, **options) -> subprocess.CompletedProcess[str]:
    command, folder = [sys.executable, "-B", "-c", code], package.parent
    return subprocess.run(command, cwd=folder, check=False, capture_output=True, text=True, **options)


def full_after(size: int) -> Callable[[], None]:
    """No file of this process, nor of what it executes, may grow beyond a size."""

    def limit() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    return limit


def test_cached_code_follows_files_of_other_rooms_that_it_was_compiled_from(package):
    inner = "from evslip.utils.jit import compiled\n@compiled()\ndef g(x):\n    return x + {}\n"
    (package / "cellar" / "inner.py").write_text(inner.format(1))
    (package / "kitchen" / "middle.py").write_text("from evslip.cellar import inner\ng = inner.g\n")
    (package / "kitchen" / "outer.py").write_text(
        "from evslip.kitchen.middle import (\n    g,\n)\nfrom evslip.utils.jit import compiled\n"
        "@compiled()\ndef f(x):\n    return 10 * g(x)\n"
    )
    for _ in range(2):
        assert run(package) == 20
        assert len(list(package.rglob("*.nbc"))) == 2
    (package / "cellar" / "inner.py").write_text(inner.format(2))
    assert run(package) == 30


def test_cached_code_may_know_a_class_that_was_renamed(package):
    outer = (
        "from typing import NamedTuple\nfrom evslip.utils.jit import compiled\n"
        "class {0}(NamedTuple):\n    x: float\n@compiled()\ndef g(pair):\n    return pair.x\n"
        "def f(x):\n    return g({0}(x))\n"
    )
    for name in ("Before", "After"):
        (package / "kitchen" / "outer.py").write_text(outer.format(name))
        assert run(package) == 1


def test_what_compiled_code_alone_calls_has_no_entry_for_python_until_python_calls_it(package):
    more = "@compiled()\ndef g(x):\n    return 3 * f(x) if x > 0 else g(-x)\n"
    (package / "kitchen" / "outer.py").write_text(KITCHEN.format(1) + more)
    count = "from evslip.kitchen.outer import f, g, compilations\nprint({} + 100 * len(compilations))"
    within, both = count.format("g(-1.0)"), count.format("g(-1.0) + f(1.0) + g(1.0)")
    assert [run(package, within) for _ in range(2)] == [6 + 2 * COMPILED, 6]
    assert len(list(package.rglob("*.nbc"))) == 2
    assert [run(package, both) for _ in range(2)] == [14 + COMPILED, 14]
    assert len(list(package.rglob("*.nbc"))) == 3
    assert run(package, within) == 6


def test_another_process_takes_a_function(package):
    (package / "kitchen" / "outer.py").write_text(KITCHEN.format(1))
    dump = "import pickle; from evslip.kitchen.outer import f; print(pickle.dumps(f).hex())"
    dumped = ended(package, dump).stdout.strip()
    assert run(package, f"import pickle; print(pickle.loads(bytes.fromhex({dumped!r}))(1.0))") == 2


@pytest.mark.parametrize("room", [0, 2000], ids=["for nothing", "for the index alone"])
def test_code_that_cannot_be_kept_is_used_and_one_line_says_so(package, room):
    outer = package / "kitchen" / "outer.py"
    more = "@compiled()\ndef g(x):\n    return f(x)\n"
    for number in (1, 2):  # the second time where files of the first lie
        outer.write_text(KITCHEN.format(number) + more)
        code = "from evslip.kitchen.outer import f, g; print(f(1.0) + g(2.0))"
        done = ended(package, code, preexec_fn=full_after(room))
        assert (done.returncode, float(done.stdout)) == (0, 3 + 2 * number)
        assert done.stderr.startswith("evslip: note: compiled code cannot be kept, ") and done.stderr.count("\n") == 1
        assert "__pycache__: File too large" in done.stderr
        assert not list(package.rglob("*.tmp.*"))
        assert run(package, COUNT) == 1 + number + COMPILED
        assert run(package, COUNT) == 1 + number


@pytest.mark.parametrize("kind", ["nbi", "nbc"])
@pytest.mark.parametrize("keep", [0, 0.5, None], ids=["emptied", "cut", "garbled"])
def test_damaged_code_is_compiled_again(kept, kind, keep):
    (path,) = kept.rglob(f"*.{kind}")
    whole = path.read_bytes()
    path.write_bytes(b"garbled" if keep is None else whole[: int(keep * len(whole))])
    assert [run(kept, COUNT) for _ in range(2)] == [2 + COMPILED, 2]


def test_code_that_was_compiled_beside_a_read_only_package_is_used_and_ones_own_is_kept_elsewhere(package, tmp_path):
    outer, home = package / "kitchen" / "outer.py", tmp_path / "home"
    outer.write_text(KITCHEN.format(1))
    assert run(package, COUNT) == 2 + COMPILED
    folders = [package, *(path for path in package.rglob("*") if path.is_dir())]
    for folder in folders:
        folder.chmod(0o555)
    home.mkdir()
    options = {"env": {"HOME": str(home)}, "preexec_fn": powerless}
    try:
        assert run(package, COUNT, **options) == 2
        other = "from evslip.kitchen.outer import f, compilations; print(f(1) + 100 * len(compilations))"
        assert [run(package, other, **options) for _ in range(2)] == [2 + COMPILED, 2]
        assert len(list(home.rglob("*.nbc"))) == len(list(package.rglob("*.nbc"))) == 1
        home.chmod(0o555)
        shutil.rmtree(home / ".cache")
        assert run(package, COUNT, **options) == 2
        assert run(package, other, **options) == 2 + COMPILED
        outer.chmod(0o644)
        outer.write_text(KITCHEN.format(2))
        assert run(package, COUNT, **options) == 3 + COMPILED
    finally:
        for folder in (*folders, home):
            folder.chmod(0o755)


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_a_fused_product_and_sum_are_rounded_once(kind):
    compute = numba.njit(lambda a, b, c: fused(a, b, c))
    numbers = np.random.default_rng(0).normal(size=(50, 2)).astype(kind)
    for a, b in numbers:
        product = Fraction(float(a)) * Fraction(float(b))
        # What is left of a product after rounding it: nothing, if the product were rounded first.
        c = -kind(float(product))
        assert compute(a, b, c) == float(product + Fraction(float(c)))
