import subprocess
import sys
import textwrap


def run(folder):
    command = [sys.executable, "-c", "from outer import f; print(f(1.0))"]
    return float(subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True).stdout)


def test_cached_code_follows_the_files_it_was_compiled_from(tmp_path):
    inner = "from evslip.compiled import compiled\n@compiled()\ndef g(x):\n    return x + {}\n"
    (tmp_path / "inner.py").write_text(inner.format(1))
    (tmp_path / "outer.py").write_text(
        textwrap.dedent("""
        from evslip.compiled import compiled
        from inner import g
        @compiled()
        def f(x):
            return 10 * g(x)
        """)
    )
    assert run(tmp_path) == 20
    assert len(list(tmp_path.glob("__pycache__/*.nbc"))) == 2
    (tmp_path / "inner.py").write_text(inner.format(2))
    assert run(tmp_path) == 30
