"""A ROS 2 node: event_camera_msgs/EventPacket in, slip probability as std_msgs/Float32 out.

python slip_node.py --ros-args -p model:=default -r events:=/event_camera/events

The parameter model names the folder of a detector. Needs rclpy and event_camera_msgs of a ROS 2 installation, and
`pip install 'evslip[learn]'` in the same Python. README.md says how it was checked on a machine without ROS.
"""

import math
from collections.abc import Callable
from typing import Any

import evslip
from evslip.codecs.ros.messages import Packet
from evslip.codecs.ros.packets import PacketDecoder


class SlipFeed:
    """The part that needs no ROS: messages in, probabilities out. A packet that comes too late is counted and left
    out."""

    def __init__(self, model: str, publish: Callable[[float], None]):
        self._model, self._publish = model, publish
        self._decoder = PacketDecoder()
        self._detector: evslip.Detector | None = None
        self.refused = 0

    def take(self, message: Any) -> None:
        """The next EventPacket."""
        size = message.width, message.height
        if self._detector is None:
            self._detector = evslip.Detector(self._model, size=size, align="centre")
        content = bytes(message.events)
        try:
            events = self._decoder.decode(Packet(size, message.seq, message.time_base, message.encoding, content))
            p_slip = self._detector.push(events)
        except (ValueError, evslip.EvslipError):
            self.refused += 1
            return
        if not math.isnan(p_slip):  # until the first window is complete
            self._publish(p_slip)


def main() -> None:
    import rclpy
    from event_camera_msgs.msg import EventPacket
    from rclpy.qos import qos_profile_sensor_data
    from std_msgs.msg import Float32

    rclpy.init()
    node = rclpy.create_node("evslip")
    model = node.declare_parameter("model", "default").value
    out = node.create_publisher(Float32, "slip_probability", 10)
    feed = SlipFeed(model, lambda p_slip: out.publish(Float32(data=p_slip)))
    node.create_subscription(EventPacket, "events", feed.take, qos_profile_sensor_data)
    try:
        rclpy.spin(node)
    finally:
        node.get_logger().info(f"{feed.refused} packets were refused")
        node.destroy_node()


if __name__ == "__main__":
    main()
