"""Messages of ROS as they lie in bags, of ROS 1 or in CDR, the encoding of ROS 2: arrays of events, images, packets.

The bags are read by the library rosbags, the messages here: it would make an object of each event. In ROS 1 the fields
follow one another; CDR begins with four bytes, aligns each number to its size from there on, and ends a text with a
zero byte.

dvs_msgs/EventArray (https://github.com/uzh-rpg/rpg_dvs_ros) and prophesee_event_msgs/EventArray: a header, the
sensor's height and width, then events of x and y as uint16, seconds and nanoseconds as 32 bits each, the polarity.
event_camera_msgs/EventPacket (https://github.com/ros-event-camera/event_camera_msgs): header, height, width, seq and
time_base as uint64, the name of an encoding, whether it is big endian, bytes of that encoding.
"""

import struct
from typing import NamedTuple

import numpy as np

from evslip.codecs.source import events_of
from evslip.events.stream import Events

ARRAYS = ("dvs_msgs/msg/EventArray", "prophesee_event_msgs/msg/EventArray")
PACKET = "event_camera_msgs/msg/EventPacket"
IMAGE = "sensor_msgs/msg/Image"
POSE = "geometry_msgs/msg/PoseStamped"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
CAMERA_INFO = "sensor_msgs/msg/CameraInfo"
FLAG = "std_msgs/msg/Bool"
_COLOURS = {"mono8": 1, "8UC1": 1, "rgb8": 3, "bgr8": 3}
EVENT = np.dtype([("x", "<u2"), ("y", "<u2"), ("s", "<u4"), ("ns", "<u4"), ("p", "u1")])
COLUMNS = ("x", "y", "s", "ns", "p")
CDR_EVENT = np.dtype(
    [("gap", "V1"), ("x", "<u2"), ("y", "<u2"), ("gap_s", "V2"), ("s", "<u4"), ("ns", "<u4"), ("p", "u1")]
)
"""An event but the first, with the gaps that align it and its seconds. The first, after the count, has none."""
_LITTLE_ENDIAN = b"\x00\x01"

Size = tuple[int, int]


class Packet(NamedTuple):
    """Content of an EventPacket."""

    size: Size
    seq: int
    time_base: int
    """Nanoseconds."""
    encoding: str
    content: bytes


class _Fields:
    """Fields of a message, one after the other. Raises struct.error or ValueError where it is damaged."""

    def __init__(self, data: bytes, cdr: bool):
        if cdr and data[:2] != _LITTLE_ENDIAN:
            raise ValueError(f"its encoding is {data[:2].hex()}, expected little-endian CDR, {_LITTLE_ENDIAN.hex()}")
        self._data, self._cdr, self._place = data, cdr, 4 if cdr else 0

    def number(self, kind: str) -> int:
        size = struct.calcsize(kind)
        if self._cdr:
            self._place += -(self._place - 4) % size
        (value,) = struct.unpack_from(f"<{kind}", self._data, self._place)
        self._place += size
        return value

    def raw(self, size: int) -> bytes:
        self._place += size
        if self._place > len(self._data):
            raise ValueError(f"{len(self._data)} bytes, its fields take {self._place}")
        return self._data[self._place - size : self._place]

    def text(self) -> str:
        return self.raw(self.number("I")).rstrip(b"\0").decode("ascii")

    def header(self) -> int:
        """Skip a header; its time in microseconds."""
        if not self._cdr:
            self.number("I")
        seconds, nanoseconds = self.number("I"), self.number("I")
        self.text()
        return seconds * 1_000_000 + nanoseconds // 1000

    def size(self) -> Size:
        """Skip a header; the sensor's (width, height) after it."""
        self.header()
        height, width = self.number("I"), self.number("I")
        return width, height

    def events(self) -> np.ndarray:
        """The rows of an array of events."""
        count = self.number("I")
        if not self._cdr or count == 0:
            return np.frombuffer(self.raw(EVENT.itemsize * count), EVENT)
        rows = np.empty(count, EVENT)
        rows[:1] = np.frombuffer(self.raw(EVENT.itemsize), EVENT)
        others = np.frombuffer(self.raw(CDR_EVENT.itemsize * (count - 1)), CDR_EVENT)
        for name in COLUMNS:
            rows[name][1:] = others[name]
        return rows


def size_of(data: bytes, cdr: bool) -> Size:
    """The sensor's (width, height) in a message of events of any kind."""
    return _Fields(data, cdr).size()


def array_events(data: bytes, cdr: bool) -> Events:
    """Events of an EventArray."""
    fields = _Fields(data, cdr)
    fields.size()
    rows = fields.events()
    return events_of(rows["s"].astype(np.int64) * 1_000_000 + rows["ns"] // 1000, rows["x"], rows["y"], rows["p"])


def packet(data: bytes, cdr: bool) -> Packet:
    """An EventPacket, its events still encoded."""
    fields = _Fields(data, cdr)
    size = fields.size()
    seq, time_base, encoding = fields.number("Q"), fields.number("Q"), fields.text()
    if fields.number("B"):
        raise ValueError("its events are big endian, expected little endian")
    return Packet(size, seq, time_base, encoding, fields.raw(fields.number("I")))


def image_size(data: bytes, cdr: bool) -> Size:
    """(width, height) of an Image of any kind."""
    fields = _Fields(data, cdr)
    fields.header()
    height, width = fields.number("I"), fields.number("I")
    return width, height


def image(data: bytes, cdr: bool) -> tuple[int, np.ndarray]:
    """Time in microseconds and pixels of an Image: uint8 of shape (h, w), or (h, w, 3) for RGB."""
    fields = _Fields(data, cdr)
    t_us = fields.header()
    height, width, encoding = fields.number("I"), fields.number("I"), fields.text()
    fields.number("B")
    step, channels = fields.number("I"), _COLOURS.get(encoding)
    if channels is None:
        raise ValueError(f"pixels in the encoding {encoding[:20]!r}; known are {', '.join(_COLOURS)}")
    rows = np.frombuffer(fields.raw(fields.number("I")), np.uint8).reshape(height, step)
    pixels = rows[:, : width * channels].reshape(height, width, channels)
    pixels = pixels[..., 0] if channels == 1 else pixels[..., :: -1 if encoding == "bgr8" else 1]
    return t_us, pixels.copy()


def pose(data: bytes, cdr: bool) -> tuple[int, tuple[float, ...]]:
    """Time in microseconds, and position in metres, then quaternion wxyz, of a PoseStamped."""
    fields = _Fields(data, cdr)
    t_us = fields.header()
    x, y, z, qx, qy, qz, qw = (float(fields.number("d")) for _ in range(7))
    return t_us, (x, y, z, qw, qx, qy, qz)


def flag(data: bytes, cdr: bool) -> bool:
    """A Bool."""
    return bool(_Fields(data, cdr).number("B"))
