"""Files of robots that are changed by a word, and what is said of wrong ones."""

from pathlib import Path

import pytest

from evslip.physics.robots.own import load
from evslip.utils.errors import ConfigError


def changed(file: Path, *pairs: tuple[str, str]) -> Path:
    """The file, in which each first text of a pair has been replaced by the second."""
    text = file.read_text()
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new)
    file.write_text(text)
    return file


def refused(robot: Path, says: str) -> None:
    """The robot is refused in one line that begins with the file."""
    with pytest.raises(ConfigError, match=says) as caught:
        load(str(robot))
    assert str(caught.value).startswith(str(robot.parent)) and "\n" not in str(caught.value)
