"""Events, images, poses and flags of the messages of a bag, whatever kind of bag it is."""

import struct
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from evslip.codecs.formats import is_bag_folder
from evslip.codecs.ros import messages
from evslip.codecs.ros.cameras import images_of
from evslip.codecs.ros.library import choose
from evslip.codecs.ros.packets import PacketDecoder
from evslip.codecs.source import Source
from evslip.events.checks import check_size
from evslip.events.stream import Events
from evslip.utils.errors import DataError
from evslip.utils.files import require_file

KINDS = (*messages.ARRAYS, messages.PACKET)
"""Types of messages of events."""
_DAMAGE = (struct.error, ValueError, LookupError)
Open = Callable[[Path], AbstractContextManager[Any]]
"""Opens a bag for the library's reader of it."""
Content = TypeVar("Content")
Decode = Callable[[bytes, bool], Content]
IMAGES = "/event_camera/image_raw"
GRIPPER, OBJECT, HELD = "/gripper/pose", "/object/pose", "/object/held"
"""Topics of the poses of a sample, and of whether the object hangs in the grip."""
TOOL = "/gripper/tool"
"""Topic of the pose of the point between the fingers in the gripper's frame."""


class Topics:
    """Content of the topics of one kind of bag; cdr: of ROS 2. Raises DataError, MissingExtraError."""

    def __init__(self, opened: Open, cdr: bool):
        self._opened, self._cdr = opened, cdr

    def stream(self, path: Path, camera: str | None = None) -> Source:
        """The events of the bag's first topic of events, and the sensor's (width, height). camera: as of `choose`."""
        if not is_bag_folder(path):
            require_file(path)
        size = next(self._sizes(path, camera), None)
        if size is None:
            return Source(None, iter(()))
        decoder = PacketDecoder()
        decoders: dict[str, Decode[Events]] = dict.fromkeys(messages.ARRAYS, messages.array_events)
        decoders[messages.PACKET] = lambda data, cdr: decoder.decode(messages.packet(data, cdr))
        parts = self._decoded(path, decoders, "message of events", camera=camera)
        return Source(check_size(*size, path), parts)

    def frames(self, path: Path, camera: str | None = None) -> Iterator[tuple[int, np.ndarray]]:
        """Times in microseconds and images, uint8 of shape (h, w) or (h, w, 3), of the first topic of images that is
        in the namespace of the camera's events, or else of the size of its sensor; where none is, of the first."""
        with self._opened(path) as reader:
            topics = _images(reader.connections, path, camera)
        if not topics:
            return iter(())
        topic = topics[0]
        if len(topics) > 1:
            size = next(self._sizes(path, camera), None)
            sizes = {messages.IMAGE: messages.image_size}
            are = (next(self._decoded(path, sizes, "image", one), None) for one in topics)
            topic = next((one for one, its in zip(topics, are, strict=True) if its == size), topic)
        return self._decoded(path, {messages.IMAGE: messages.image}, "or unknown image", topic)

    def _sizes(self, path: Path, camera: str | None) -> Iterator[messages.Size]:
        """The sensor's (width, height) in each message of a camera's events."""
        return self._decoded(path, dict.fromkeys(KINDS, messages.size_of), "message of events", camera=camera)

    def poses(self, path: Path, topic: str) -> Iterator[tuple[int, tuple[float, ...]]]:
        """Times in microseconds and poses, position in metres and quaternion wxyz, of a topic; none where it is not
        there."""
        return self._decoded(path, {messages.POSE: messages.pose}, "pose", topic)

    def flags(self, path: Path, topic: str) -> Iterator[bool]:
        """Flags of a topic; none where it is not there."""
        return self._decoded(path, {messages.FLAG: messages.flag}, "flag", topic)

    def _read(self, path: Path, kinds: tuple[str, ...], topic: str, camera: str | None) -> Iterator[tuple[str, bytes]]:
        """Types and bytes of the messages of the first topic of some types, of a named one or of a camera's, in the
        order of their time."""
        with self._opened(path) as reader:
            wanted = choose(reader.connections, kinds, path, topic, camera)
            for connection, _, data in reader.messages(wanted) if wanted else ():
                yield connection.msgtype, data

    def _decoded(
        self, path: Path, decoders: dict[str, Decode[Content]], what: str, topic: str = "", camera: str | None = None
    ) -> Iterator[Content]:
        """What the decoder of its type makes of each message."""
        for kind, data in self._read(path, tuple(decoders), topic, camera):
            try:
                content = decoders[kind](data, self._cdr)
            except _DAMAGE as error:
                raise DataError(f"{path}: damaged {what}: {' '.join(str(error).split())[:160]}") from None
            yield content


def _images(connections: Sequence[Any], path: Path, camera: str | None) -> list[str]:
    """Topics of images that may be of a camera; all of a bag without events."""
    images = list(dict.fromkeys(c.topic for c in connections if c.msgtype == messages.IMAGE))
    events = {c.topic for c in connections if c.msgtype in KINDS}
    if not events:
        return images
    chosen = choose(connections, KINDS, path, camera=camera)[0].topic
    return images_of(chosen, sorted(events - {chosen}), images)
