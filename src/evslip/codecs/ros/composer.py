"""Bytes of messages, of ROS 1 or in CDR, the encoding of ROS 2; `messages` reads them."""

import struct
from collections.abc import Sequence
from typing import Any

import numpy as np

from evslip.codecs.ros import messages
from evslip.codecs.ros.definitions import types
from evslip.codecs.ros.messages import Size
from evslip.events.stream import Events

TEXT, NUMBER = "std_msgs/msg/String", "std_msgs/msg/Float32"
_LITTLE_ENDIAN = b"\x00\x01\x00\x00"


def camera_frame(camera: str | None) -> str:
    """Coordinate frame of a camera of several, or of the only one, None."""
    return "camera" if camera is None else f"{camera}_camera"


class Composer:
    """Messages of one kind of bag; cdr: of ROS 2; camera: name of a camera of several."""

    def __init__(self, cdr: bool, camera: str | None = None):
        self._cdr, self._store, self._frame = cdr, types(cdr), camera_frame(camera)

    def packet(self, t_us: int, size: Size, seq: int, time_base_ns: int, encoding: str, content: bytes) -> bytes:
        """An EventPacket."""
        events = np.frombuffer(content, np.uint8)
        fields = (self._header(t_us, self._frame), size[1], size[0], seq, time_base_ns, encoding, False, events)
        return self._packed(messages.PACKET, *fields)

    def array(self, events: Events, size: Size, seq: int) -> bytes:
        """An EventArray, made here: the library would make an object of each event."""
        t_us = int(events.t_us[0]) if events.count else 0
        head = struct.pack("<II", t_us // 10**6, t_us % 10**6 * 1000)
        rows = np.zeros(events.count, messages.CDR_EVENT if self._cdr else messages.EVENT)
        values = events.x, events.y, events.t_us // 10**6, events.t_us % 10**6 * 1000, events.p
        for name, column in zip(messages.COLUMNS, values, strict=True):
            rows[name] = column
        name = self._frame.encode()
        if not self._cdr:
            head = struct.pack("<I", seq) + head + struct.pack("<I", len(name)) + name
            return head + struct.pack("<III", size[1], size[0], events.count) + rows.tobytes()
        # The name ends in a zero, and in others that align what follows; the first event has no gap before it.
        name += b"\0"
        head = _LITTLE_ENDIAN + head + struct.pack("<I", len(name)) + name + bytes(-len(name) % 4)
        first = np.zeros(min(1, events.count), messages.EVENT)
        for name in messages.COLUMNS:
            first[name] = rows[name][:1]
        return head + struct.pack("<III", size[1], size[0], events.count) + first.tobytes() + rows[1:].tobytes()

    def image(self, t_us: int, pixels: np.ndarray) -> bytes:
        """An Image, mono8 or rgb8, of uint8 of shape (h, w) or (h, w, 3)."""
        height, width = pixels.shape[:2]
        encoding, step = ("mono8", width) if pixels.ndim == 2 else ("rgb8", 3 * width)
        fields = (self._header(t_us, self._frame), height, width, encoding, 0, step, pixels.reshape(-1))
        return self._packed(messages.IMAGE, *fields)

    def camera_info(self, t_us: int, size: Size, focal_px: float, distortion: tuple[float, ...]) -> bytes:
        """A CameraInfo of a camera whose axis goes through the middle of the image; distortion: k1, k2, p1, p2.

        ROS counts places from the middle of the first pixel.
        """
        width, height = size
        matrix = np.array([[focal_px, 0, (width - 1) / 2], [0, focal_px, (height - 1) / 2], [0, 0, 1]])
        projection = np.hstack([matrix, np.zeros((3, 1))]).ravel()
        terms = np.array([*distortion, 0.0])
        region = self._made("sensor_msgs/msg/RegionOfInterest", 0, 0, 0, 0, False)
        fields = (self._header(t_us, self._frame), height, width, "plumb_bob", terms)
        return self._packed(messages.CAMERA_INFO, *fields, matrix.ravel(), np.eye(3).ravel(), projection, 0, 0, region)

    def pose(self, t_us: int, pose: np.ndarray, frame: str = "world") -> bytes:
        """A PoseStamped; pose: position in metres, then quaternion wxyz, of shape (7,)."""
        place, turn = self._placed("geometry_msgs/msg/Point", pose)
        return self._packed(messages.POSE, self._header(t_us, frame), self._made("geometry_msgs/msg/Pose", place, turn))

    def transforms(self, t_us: int, frames: Sequence[tuple[str, str, np.ndarray]]) -> bytes:
        """A TFMessage; frames: parent, child, and the child's pose in the parent as in `pose`."""
        made = []
        for parent, child, pose in frames:
            transform = self._made("geometry_msgs/msg/Transform", *self._placed("geometry_msgs/msg/Vector3", pose))
            made.append(self._made("geometry_msgs/msg/TransformStamped", self._header(t_us, parent), child, transform))
        return self._packed(messages.TRANSFORMS, made)

    def _placed(self, kind: str, pose: np.ndarray) -> tuple[Any, Any]:
        x, y, z, qw, qx, qy, qz = pose.tolist()
        return self._made(kind, x, y, z), self._made("geometry_msgs/msg/Quaternion", qx, qy, qz, qw)

    def value(self, kind: str, value: Any) -> bytes:
        """A message with one field: TEXT, NUMBER or FLAG."""
        return self._packed(kind, value)

    def _header(self, t_us: int, frame: str) -> Any:
        stamp = self._made("builtin_interfaces/msg/Time", t_us // 10**6, t_us % 10**6 * 1000)
        return self._made("std_msgs/msg/Header", *((stamp, frame) if self._cdr else (0, stamp, frame)))

    def _made(self, kind: str, *fields: Any) -> Any:
        return self._store.types[kind](*fields)

    def _packed(self, kind: str, *fields: Any) -> bytes:
        pack = self._store.serialize_cdr if self._cdr else self._store.serialize_ros1
        return bytes(pack(self._made(kind, *fields), kind))
