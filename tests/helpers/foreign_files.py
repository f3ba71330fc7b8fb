"""Files in formats that evslip reads but does not write."""

from pathlib import Path
from typing import Any, cast

import numpy as np

from evslip.codecs.ros import bag as rosbag
from evslip.events.stream import Events


def aedat2(events: Events, size: tuple[int, int], header: bytes = b"") -> bytes:
    """As v2e and jAER write a DAVIS's events: mirrored both ways."""
    x, y = (side - 1 - column.astype(int) for side, column in zip(size, (events.x, events.y), strict=True))
    words = np.stack([x << 12 | y << 22 | events.p.astype(int) << 11, events.t_us], 1)
    return b"#!AER-DAT2.0\r\n# made by hand\r\n" + header + words.astype(">u4").tobytes()


def bag(path: Path, events: Events, size: tuple[int, int], images: list[np.ndarray], pieces: int = 3) -> None:
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    store.register(get_types_from_msg("uint16 x\nuint16 y\ntime ts\nbool polarity\n", "dvs_msgs/msg/Event"))
    text = "std_msgs/Header header\nuint32 height\nuint32 width\ndvs_msgs/Event[] events\n"
    store.register(get_types_from_msg(text, "dvs_msgs/msg/EventArray"))
    event, array, image_type = (store.types[f"{n}"] for n in ("dvs_msgs/msg/Event", rosbag._KINDS[0], rosbag._IMAGE))
    time, head = store.types["builtin_interfaces/msg/Time"], store.types["std_msgs/msg/Header"]
    with Writer(path) as writer:
        topic = writer.add_connection("/dvs/events", rosbag._KINDS[0], typestore=store)
        other = writer.add_connection("/dvs/image_raw", rosbag._IMAGE, typestore=store)
        for number, part in enumerate(np.array_split(np.arange(events.count), pieces)):
            header = head(number, time(0, 0), "dvs")
            rows = [
                event(int(x), int(y), time(int(t) // 10**6, int(t) % 10**6 * 1000 + 999), bool(p))
                for t, x, y, p in zip(*events[part].columns, strict=True)
            ]
            message: Any = array(header, size[1], size[0], cast(Any, rows))
            writer.write(topic, number, store.serialize_ros1(message, rosbag._KINDS[0]))
        for number, image in enumerate(images):
            header = head(number, time(2, 5000 * number), "dvs")
            flat, encoding = image.reshape(-1), "mono8" if image.ndim == 2 else "bgr8"
            step = image.shape[1] * (1 if image.ndim == 2 else 3)
            message = image_type(header, *image.shape[:2], encoding, 0, step, flat)
            writer.write(other, number, store.serialize_ros1(message, rosbag._IMAGE))
