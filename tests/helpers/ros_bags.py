"""Bags of ROS 1 and ROS 2 that the library rosbags writes."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from evslip.codecs.prophesee import evt3
from evslip.codecs.ros.messages import ARRAYS, IMAGE, PACKET
from evslip.events.stream import Events

SUFFIXES = (".bag", ".db3", ".mcap")
_ARRAY = "std_msgs/Header header\nuint32 height\nuint32 width\ndvs_msgs/Event[] events\n"
_PACKET = (
    "std_msgs/Header header\nuint32 height\nuint32 width\nuint64 seq\nuint64 time_base\nstring encoding\n"
    "bool is_bigendian\nuint8[] events\n"
)


class Message(NamedTuple):
    topic: str
    kind: str
    fields: tuple[Any, ...]


class Library:
    """The library's types, and what makes and writes messages of them."""

    def __init__(self, path: Path, packed: str = ""):
        """path: of the bag; its suffix says the kind. packed: "message", "file" or "storage", for ROS 2."""
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore

        self.path, self.packed = path, packed
        self.first = path.suffix == ".bag"
        self.store = get_typestore(Stores.ROS1_NOETIC if self.first else Stores.ROS2_HUMBLE)
        time = "time" if self.first else "builtin_interfaces/Time"
        texts = {"dvs_msgs/msg/Event": f"uint16 x\nuint16 y\n{time} ts\nbool polarity\n", ARRAYS[0]: _ARRAY}
        for name, text in {**texts, PACKET: _PACKET}.items():
            self.store.register(get_types_from_msg(text, name))

    def time(self, t_us: int, nanoseconds: int = 0) -> Any:
        return self.store.types["builtin_interfaces/msg/Time"](t_us // 10**6, t_us % 10**6 * 1000 + nanoseconds)

    def header(self, t_us: int) -> Any:
        kind = self.store.types["std_msgs/msg/Header"]
        return kind(0, self.time(t_us), "dvs") if self.first else kind(self.time(t_us), "dvs")

    def array(self, events: Events, size: tuple[int, int], topic: str = "/dvs/events") -> Message:
        event = self.store.types["dvs_msgs/msg/Event"]
        rows = [
            event(int(x), int(y), self.time(int(t), 999), bool(p)) for t, x, y, p in zip(*events.columns, strict=True)
        ]
        return Message(topic, ARRAYS[0], (self.header(0), size[1], size[0], rows))

    def packet(self, content: bytes, size: tuple[int, int], seq: int, encoding: str, base_ns: int = 0) -> Message:
        events = np.frombuffer(content, np.uint8)
        fields = (self.header(0), size[1], size[0], seq, base_ns, encoding, False, events)
        return Message("/event_camera/events", PACKET, fields)

    def image(self, pixels: np.ndarray, t_us: int, topic: str = "/dvs/image_raw") -> Message:
        grey = pixels.ndim == 2
        step = pixels.shape[1] * (1 if grey else 3)
        fields = (self.header(t_us), *pixels.shape[:2], "mono8" if grey else "bgr8", 0, step, pixels.reshape(-1))
        return Message(topic, IMAGE, fields)

    def write(self, messages: Iterable[Message]) -> Path:
        """Write the bag; of ROS 2 it is a folder. Returns its path, or that of the file in it."""
        from rosbags.rosbag1 import Writer as Writer1
        from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
        from rosbags.rosbag2 import Writer as Writer2

        if self.first:
            writer: Any = Writer1(self.path)
        else:
            plugin = StoragePlugin.MCAP if self.path.suffix == ".mcap" else StoragePlugin.SQLITE3
            writer = Writer2(self.path.with_suffix(""), version=9, storage_plugin=plugin)
            if self.packed:
                writer.set_compression(CompressionMode[self.packed.upper()], CompressionFormat.ZSTD)
        pack = self.store.serialize_ros1 if self.first else self.store.serialize_cdr
        topics: dict[str, Any] = {}
        with writer:
            for number, message in enumerate(messages):
                if message.topic not in topics:
                    topics[message.topic] = writer.add_connection(message.topic, message.kind, typestore=self.store)
                made: Any = self.store.types[message.kind](*message.fields)
                writer.write(topics[message.topic], number, pack(made, message.kind))
        return self.path if self.first else next(self.path.with_suffix("").glob(f"*{self.path.suffix}*"))


def arrays(path: Path, events: Events, size: tuple[int, int], images: list[np.ndarray], pieces: int = 3) -> Path:
    """A bag of EventArray and Image."""
    library = Library(path)
    parts = [library.array(events.select(part), size) for part in np.array_split(np.arange(len(events)), pieces)]
    return library.write([*parts, *(library.image(image, 2_000_000 + 5 * n) for n, image in enumerate(images))])


def packets(
    path: Path, events: Events, size: tuple[int, int], encoding: str, pieces: int = 3, packed: str = ""
) -> Path:
    """A bag of EventPacket."""
    library, encoder = Library(path, packed), evt3.Encoder()
    parts = [events.select(part) for part in np.array_split(np.arange(len(events)), pieces)]
    if encoding == "evt3":
        contents = [(0, encoder.encode(part).astype("<u2").tobytes()) for part in parts]
    else:
        contents = [_eight_bytes(part, encoding) for part in parts]
    return library.write(
        library.packet(content, size, seq, encoding, base_ns) for seq, (base_ns, content) in enumerate(contents)
    )


def _eight_bytes(events: Events, encoding: str) -> tuple[int, bytes]:
    """time_base in nanoseconds, and 8 bytes an event, as the description of the message has them."""
    t_us, x, y, p = (column.astype(np.uint64) for column in events.columns)
    base_us = int(t_us[0]) if len(t_us) else 0
    if encoding == "mono":
        words = (t_us - np.uint64(base_us)) * 1000 + 999 | x << 32 | y << 48 | p << 63
    else:
        words = p << 1 | y << 2 | x << 17 | (t_us - np.uint64(base_us)) << 32
    return 1000 * base_us, words.astype("<u8").tobytes()
