"""The library rosbags, as all kinds of bags use it."""

import contextlib
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from evslip.codecs.arrays.record_head import wrong_camera
from evslip.codecs.ros.cameras import names
from evslip.codecs.ros.messages import FLAG, IMAGE, POSE
from evslip.utils.errors import DataError, MissingExtraError


@contextlib.contextmanager
def reading(path: Path) -> Iterator[None]:
    """Say in one line what is wrong with a bag. Raises DataError, MissingExtraError."""
    try:
        yield
    except DataError:
        raise
    except ModuleNotFoundError:
        raise MissingExtraError(f"{path}: bags need the package rosbags: pip install 'evslip[ros]'") from None
    except Exception as error:  # the library lets struct, lz4, SQLite and others speak for themselves
        reason = " ".join(str(error).split())[:160] or type(error).__name__
        raise DataError(f"{path}: damaged bag: {reason}") from None


@contextlib.contextmanager
def plainly_named(path: Path) -> Iterator[Path]:
    """A path to the same file or folder that SQLite's addresses, as the library writes them, can hold."""
    if not set("#?%") & set(str(path.absolute())):
        yield path
        return
    with tempfile.TemporaryDirectory() as folder:
        link = Path(folder) / f"bag{path.suffix.lower()}"
        link.symlink_to(path.absolute())
        yield link


def choose(
    connections: Sequence[Any], kinds: tuple[str, ...], path: Path, topic: str = "", camera: str | None = None
) -> list[Any]:
    """The connections of the first topic of some types, or of the one that is named.

    camera: the name of a topic of events, where there are several. Raises DataError where there is none, but for
    images, poses and flags, and where nobody said which of several cameras is meant.
    """
    topics = [c for c in connections if c.msgtype in kinds and topic in ("", c.topic)]
    if kinds not in ((IMAGE,), (POSE,), (FLAG,)):
        if not topics:
            found = ", ".join(sorted({c.msgtype for c in connections})) or "none"
            raise DataError(f"{path}: holds no events; its messages are {found[:160]}")
        topics = _seen_by(topics, camera, path)
    return [c for c in topics if (c.topic, c.msgtype) == (topics[0].topic, topics[0].msgtype)]


def _seen_by(topics: list[Any], camera: str | None, path: Path) -> list[Any]:
    """Those of a camera."""
    distinct = sorted({c.topic for c in topics})
    named = dict(zip(names(distinct), distinct, strict=True))
    if camera is None and len(named) == 1:
        return topics
    if camera not in named:
        raise DataError(f"{path}: {wrong_camera(tuple(sorted(named)) if len(named) > 1 else (), camera)}")
    return [c for c in topics if c.topic == named[camera]]
