"""Files that are read."""

import os

from evslip.utils.files import printable, stamp_of


def test_a_stamp_tells_files_apart(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    path = tmp_path / "file"
    path.write_bytes(b"some")
    os.utime(path, ns=(0, 5))
    assert stamp_of(path) == stamp_of(str(path)) == stamp_of("~/file") == (5, 4)
    path.write_bytes(b"same")
    os.utime(path, ns=(0, 6))
    assert stamp_of(path) == (6, 4)


def test_what_is_not_there_has_a_stamp_too(tmp_path):
    for name in (tmp_path / "none", tmp_path / "none" / "of it", "~nobody at all/x", "\0", "x" * 5000):
        assert stamp_of(name) == (0, 0)


def test_a_name_of_any_bytes_can_be_stored():
    names = [os.fsdecode(name) for name in (b"r\xffc", "größer".encode(), b"a\\b")]
    assert [printable(name) for name in names] == ["r\\xffc", "größer", "a\\b"]
