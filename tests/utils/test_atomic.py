import os

import pytest

from evslip.utils.atomic import write_bytes
from evslip.utils.errors import StorageError


def test_writes_and_replaces(tmp_path):
    path = tmp_path / "new" / "file"
    write_bytes(path, b"first")
    write_bytes(path, b"second")
    assert path.read_bytes() == b"second"
    assert [p.name for p in path.parent.iterdir()] == ["file"]


def test_a_folder_in_the_way_is_one_clear_line_and_leaves_nothing(tmp_path):
    (tmp_path / "file").mkdir()
    with pytest.raises(StorageError, match=r"cannot write .*file"):
        write_bytes(tmp_path / "file", b"x")
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


def test_a_file_where_a_folder_should_be(tmp_path):
    (tmp_path / "parent").write_text("")
    with pytest.raises(StorageError, match=r"not a folder|in the way"):
        write_bytes(tmp_path / "parent" / "file", b"x")


def test_a_full_disk_is_one_clear_line_and_leaves_nothing(tmp_path, monkeypatch):
    def full(descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(StorageError, match="no space left"):
        write_bytes(tmp_path / "file", b"x")
    assert not list(tmp_path.iterdir())
