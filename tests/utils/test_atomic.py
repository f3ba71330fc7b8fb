import fcntl
import os
import signal
import subprocess
import sys

import pytest

from evslip.utils.atomic import require_place, scratch_folder, staged, staged_folder, write_bytes
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


def test_what_a_killed_writer_left_goes_when_the_file_is_written_again(tmp_path):
    script = (
        "import sys, time; from pathlib import Path; from evslip.utils.atomic import staged\n"
        "with staged(Path(sys.argv[1])) as file: file.write(b'half'); print('now', flush=True); time.sleep(60)"
    )
    with subprocess.Popen([sys.executable, "-c", script, tmp_path / "a.h5"], stdout=subprocess.PIPE) as writer:
        assert writer.stdout is not None and writer.stdout.readline() == b"now\n"
        (half,) = tmp_path.iterdir()
        os.utime(half, (0, 0))
        write_bytes(tmp_path / "a.h5", b"whole")
        assert half.exists()  # its writer lives
        writer.send_signal(signal.SIGKILL)
        writer.wait()
    write_bytes(tmp_path / "b.h5", b"another file")
    assert half.exists()
    write_bytes(tmp_path / "a.h5", b"whole")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.h5", "b.h5"]


def test_only_temporary_files_of_the_same_name_that_nobody_holds_are_removed(tmp_path):
    names = (".a.h5.0123abcd.tmp", ".a.h5.0123abc.tmp", ".aXh5.0123abcd.tmp", ".a.h5.89abcdef.tmp")
    for name in names:
        (tmp_path / name).touch()
    with (tmp_path / names[3]).open("rb") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        write_bytes(tmp_path / "a.h5", b"x")
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([*names[1:], "a.h5"])


@pytest.mark.parametrize("moment", ["before the lock", "under the lock"])
def test_a_writer_whose_file_is_cleared_as_it_is_made_makes_another(tmp_path, monkeypatch, moment):
    path, flock, rivals = tmp_path / "a.h5", fcntl.flock, []

    def raced(file, operation):
        if not rivals:
            (mine,) = tmp_path.iterdir()
            rivals.append(mine.open("rb"))
            if moment == "under the lock":
                flock(rivals[0], fcntl.LOCK_EX)
            else:
                mine.unlink()
        return flock(file, operation)

    monkeypatch.setattr(fcntl, "flock", raced)
    write_bytes(path, b"whole")
    assert path.read_bytes() == b"whole"
    with rivals[0]:
        pass


def test_a_folder_that_a_killed_writer_left_goes_and_one_that_is_held_stays(tmp_path):
    (tmp_path / ".a.db3.0123abcd.tmp" / "made").mkdir(parents=True)
    with scratch_folder(tmp_path / "a.db3") as held:
        write_bytes(tmp_path / "a.db3", b"x")
        assert sorted(path.name for path in tmp_path.iterdir()) == sorted([held.name, "a.db3"])
    assert [path.name for path in tmp_path.iterdir()] == ["a.db3"]


def test_a_signal_between_opening_and_locking_leaves_nothing(tmp_path, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(fcntl, "flock", interrupted)
    with pytest.raises(KeyboardInterrupt), staged(tmp_path / "new" / "a.csv"):
        pass
    assert not list(tmp_path.iterdir())


def test_a_staged_folder_removes_what_a_killed_writer_of_it_left(tmp_path):
    (tmp_path / ".a.0123abcd.tmp" / "half").mkdir(parents=True)
    with staged_folder(tmp_path / "a") as folder:
        (folder / "whole").touch()
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["a", "whole"]


@pytest.mark.parametrize(("module", "name"), [(os, "open"), (fcntl, "flock")])
def test_a_folder_that_is_cleared_as_it_is_made_is_made_again(tmp_path, monkeypatch, module, name):
    call, taken = getattr(module, name), []

    def raced(*arguments, **options):
        if not taken:
            taken.extend(tmp_path.iterdir())
            taken[0].rmdir()
        return call(*arguments, **options)

    monkeypatch.setattr(module, name, raced)
    with scratch_folder(tmp_path / "a.db3") as folder:
        assert taken == [folder]
        assert folder.is_dir()


def test_an_interrupt_at_any_moment_leaves_no_folder(tmp_path, monkeypatch):
    for place in ("mkdir", "replace"):
        with monkeypatch.context() as patch:
            before = getattr(os if place == "mkdir" else type(tmp_path), place)

            def interrupted(*arguments, before=before, **options):
                before(*arguments, **options)
                raise KeyboardInterrupt

            patch.setattr(os if place == "mkdir" else type(tmp_path), place, interrupted)
            with pytest.raises(KeyboardInterrupt):
                write_bytes(tmp_path / "new" / "a.h5", b"x")
        left = [path for path in tmp_path.rglob("*") if path.is_file()]
        assert left == ([] if place != "replace" else [tmp_path / "new" / "a.h5"])


def test_where_a_file_cannot_be_written_is_said_without_writing(tmp_path):
    (tmp_path / "file").touch()
    require_place(tmp_path / "file")
    require_place(tmp_path / "new" / "folder" / "file")
    with pytest.raises(StorageError, match=r"cannot write .*file/a/b: a parent of it is a file, not a folder"):
        require_place(tmp_path / "file" / "a" / "b")
    with pytest.raises(StorageError, match="it is a folder, a file was expected"):
        require_place(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
