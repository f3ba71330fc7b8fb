"""Events and images of the messages of a bag, whatever kind of bag it is."""

import struct
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from evslip.codecs.ros.messages import (
    ARRAYS,
    FLAG,
    IMAGE,
    PACKET,
    POSE,
    array_events,
    flag,
    image,
    packet,
    pose,
    size_of,
)
from evslip.codecs.ros.packets import PacketDecoder
from evslip.codecs.source import Source
from evslip.events.checks import check_size
from evslip.events.stream import Events
from evslip.utils.errors import DataError

KINDS = (*ARRAYS, PACKET)
"""Types of messages of events."""
_DAMAGE = (struct.error, ValueError, LookupError)
Messages = Callable[..., Iterator[tuple[str, bytes]]]
"""Types and bytes of the messages of the first topic of some types, or of a named one, in the order of their time."""
IMAGES = "/event_camera/image_raw"
GRIPPER, OBJECT, HELD = "/gripper/pose", "/object/pose", "/object/held"
"""Topics of the poses of a sample, and of whether the object hangs in the grip."""
TOOL = "/gripper/tool"
"""Topic of the pose of the point between the fingers in the gripper's frame."""


def events_source(messages: Messages, path: Path, cdr: bool) -> Source:
    """The events of the first topic of events, and the sensor's (width, height). Raises DataError."""
    first = next(messages(KINDS), None)
    if first is None:
        return Source(None, iter(()))
    try:
        width, height = size_of(first[1], cdr)
    except _DAMAGE as error:
        raise _damaged(path, error) from None
    return Source(check_size(width, height, path), _parts(messages, path, cdr))


def frames_of(messages: Messages, path: Path, cdr: bool, topic: str = "") -> Iterator[tuple[int, np.ndarray]]:
    """Times in microseconds and images, uint8 of shape (h, w) or (h, w, 3), of a topic, or of the first one."""
    for _, data in messages((IMAGE,), topic):
        try:
            yield image(data, cdr)
        except _DAMAGE as error:
            raise DataError(f"{path}: damaged or unknown image: {error}") from None


def poses_of(messages: Messages, path: Path, cdr: bool, topic: str) -> Iterator[tuple[int, tuple[float, ...]]]:
    """Times in microseconds and poses, position in metres and quaternion wxyz, of a topic; none where it is not
    there."""
    for _, data in messages((POSE,), topic):
        try:
            yield pose(data, cdr)
        except _DAMAGE as error:
            raise DataError(f"{path}: damaged pose: {error}") from None


def flags_of(messages: Messages, path: Path, cdr: bool, topic: str) -> Iterator[bool]:
    """Flags of a topic; none where it is not there."""
    for _, data in messages((FLAG,), topic):
        try:
            yield flag(data, cdr)
        except _DAMAGE as error:
            raise DataError(f"{path}: damaged flag: {error}") from None


def _parts(messages: Messages, path: Path, cdr: bool) -> Iterator[Events]:
    decoder = PacketDecoder()
    for kind, data in messages(KINDS):
        try:
            events = decoder.decode(packet(data, cdr)) if kind == PACKET else array_events(data, cdr)
        except _DAMAGE as error:
            raise _damaged(path, error) from None
        yield events


def _damaged(path: Path, error: Exception) -> DataError:
    return DataError(f"{path}: damaged message of events: {' '.join(str(error).split())[:160]}")
