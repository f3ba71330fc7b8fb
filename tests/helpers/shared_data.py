"""Data that lies beside the repository on some machines: golden files and real recordings."""

from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[3] / "shared"


def shared(*parts: str) -> Path:
    """A path inside the shared folder; skips the test where it is absent."""
    path = FOLDER.joinpath(*parts)
    if not path.exists():
        pytest.skip(f"needs {'/'.join(parts)} of the shared data folder, which is not beside this checkout")
    return path
