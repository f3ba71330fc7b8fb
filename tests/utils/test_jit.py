import shutil
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import numba
import numpy as np
import pytest

import evslip
from evslip.utils.jit import fused


@pytest.fixture
def package(tmp_path) -> Path:
    """A package of three rooms with evslip's decorator."""
    package = tmp_path / "evslip"
    for folder in (package, *(package / room for room in ("utils", "kitchen", "cellar"))):
        folder.mkdir()
        (folder / "__init__.py").touch()
    shutil.copy(Path(evslip.__file__).parent / "utils" / "jit.py", package / "utils")
    return package


def run(package: Path) -> float:
    command = [sys.executable, "-c", "from evslip.kitchen.outer import f; print(f(1.0))"]
    return float(subprocess.run(command, cwd=package.parent, check=True, capture_output=True, text=True).stdout)


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


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_a_fused_product_and_sum_are_rounded_once(kind):
    compute = numba.njit(lambda a, b, c: fused(a, b, c))
    numbers = np.random.default_rng(0).normal(size=(50, 2)).astype(kind)
    for a, b in numbers:
        product = Fraction(float(a)) * Fraction(float(b))
        # What is left of a product after rounding it: nothing, if the product were rounded first.
        c = -kind(float(product))
        assert compute(a, b, c) == float(product + Fraction(float(c)))
