"""Objects of other packages."""

import sys

import pytest

from evslip.utils.errors import ConfigError
from evslip.utils.plugins import load


@pytest.mark.parametrize("text", ["import sys\nsys.exit(3)", "raise ValueError('no')", "def"])
def test_a_module_that_does_not_load_is_said_in_one_line(text, tmp_path, monkeypatch):
    (tmp_path / "own_script.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ConfigError, match=r"^own_script:Mine cannot be loaded: \w+: .*; expected module or"):
        load("own_script:Mine")
    sys.modules.pop("own_script", None)
