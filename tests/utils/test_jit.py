import shutil
import subprocess
import sys
from pathlib import Path

import evslip


def run(folder: Path) -> float:
    command = [sys.executable, "-c", "from evslip.kitchen.outer import f; print(f(1.0))"]
    return float(subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True).stdout)


def test_cached_code_follows_files_of_other_rooms_that_it_was_compiled_from(tmp_path):
    package = tmp_path / "evslip"
    for room in ("utils", "kitchen", "cellar"):
        (package / room).mkdir(parents=True)
        (package / room / "__init__.py").touch()
    (package / "__init__.py").touch()
    shutil.copy(Path(evslip.__file__).parent / "utils" / "jit.py", package / "utils")
    inner = "from evslip.utils.jit import compiled\n@compiled()\ndef g(x):\n    return x + {}\n"
    (package / "cellar" / "inner.py").write_text(inner.format(1))
    (package / "kitchen" / "middle.py").write_text("from evslip.cellar import inner\ng = inner.g\n")
    (package / "kitchen" / "outer.py").write_text(
        "from evslip.kitchen.middle import (\n    g,\n)\nfrom evslip.utils.jit import compiled\n"
        "@compiled()\ndef f(x):\n    return 10 * g(x)\n"
    )
    assert run(tmp_path) == 20
    assert len(list(package.rglob("*.nbc"))) == 2
    assert run(tmp_path) == 20
    assert len(list(package.rglob("*.nbc"))) == 2
    (package / "cellar" / "inner.py").write_text(inner.format(2))
    assert run(tmp_path) == 30
