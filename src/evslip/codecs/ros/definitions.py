"""Types of the messages that evslip writes, as the library rosbags knows them, and those of events beside its own."""

from functools import cache
from typing import Any

from evslip.codecs.ros.messages import ARRAYS, PACKET, TRANSFORMS

_ARRAY = "std_msgs/Header header\nuint32 height\nuint32 width\ndvs_msgs/Event[] events\n"
_PACKET = (
    "std_msgs/Header header\nuint32 height\nuint32 width\nuint64 seq\nuint64 time_base\nstring encoding\n"
    "bool is_bigendian\nuint8[] events\n"
)
_TRANSFORMS = "geometry_msgs/TransformStamped[] transforms\n"


@cache
def types(cdr: bool) -> Any:
    """The library's store of types, of ROS 1 or of ROS 2."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store: Any = get_typestore(Stores.ROS2_HUMBLE if cdr else Stores.ROS1_NOETIC)
    time = "builtin_interfaces/Time" if cdr else "time"
    event = f"uint16 x\nuint16 y\n{time} ts\nbool polarity\n"
    texts = {"dvs_msgs/msg/Event": event, ARRAYS[0]: _ARRAY, PACKET: _PACKET, TRANSFORMS: _TRANSFORMS}
    for name, text in texts.items():
        store.register(get_types_from_msg(text, name))
    return store
