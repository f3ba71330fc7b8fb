"""A lock that processes share, also those of several machines, and that falls with its holder, however that ends."""

import contextlib
import fcntl
import functools
import socket
import time
import uuid
from collections.abc import Iterator
from pathlib import Path

PATIENCE_S = 30.0
"""A hold of another machine's that lasts so long counts as left behind."""
PAUSE_S = 0.01


@contextlib.contextmanager
def held(path: Path) -> Iterator[None]:
    """The lock named `path` for the block, waited for. Raises OSError.

    Within a machine it is a lock of the operating system's on the file PATH.lock, which ends with its process. Between
    machines such locks mean nothing on some file systems (NFS with nolock, BeeGFS, sshfs): there the link PATH.holder
    stands for the hold, and what it points to names the holder. A killed holder leaves it: the next one of the same
    machine, which has the other lock, takes it away at once.
    """
    link = path.with_name(f"{path.name}.holder")
    with path.with_name(f"{path.name}.lock").open("ab") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX)
            is_alone = True
        except OSError:  # a file system without locks
            is_alone = False
        mark = _claim(link, is_alone)
        try:
            yield
        finally:
            if _holder(link) == mark:
                link.unlink()


def _claim(link: Path, is_alone: bool) -> str:
    """Make the link, and return what it points to; `is_alone`: no other process of this machine is about to."""
    mark = f"{_machine()}:{uuid.uuid4().hex}"
    seen, since = None, 0.0
    while True:
        try:
            link.symlink_to(mark)
            return mark
        except FileExistsError:
            there = _holder(link)
        if there != seen:
            seen, since = there, time.monotonic()
        is_ours = there is not None and there.startswith(f"{_machine()}:")
        if (is_alone and is_ours) or time.monotonic() - since > PATIENCE_S:
            link.unlink(missing_ok=True)
        else:
            time.sleep(PAUSE_S)


def _holder(link: Path) -> str | None:
    try:
        return str(link.readlink())
    except FileNotFoundError:
        return None


@functools.cache
def _machine() -> str:
    """Another one on each machine, and after each of its starts: processes that have the same share locks of files."""
    try:
        return Path("/proc/sys/kernel/random/boot_id").read_text().strip()
    except OSError:
        return socket.gethostname()
