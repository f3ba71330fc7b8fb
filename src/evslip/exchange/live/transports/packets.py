"""Receiver of ROS 2's EventPackets as rmw_zenoh sends them: in CDR, under a key that names domain, topic and type."""

import struct
from collections.abc import Sequence

from evslip.codecs.ros.messages import packet
from evslip.codecs.ros.packets import PacketDecoder
from evslip.events.stream import Events, concatenate
from evslip.exchange.live.address import Address
from evslip.exchange.live.source import Piece
from evslip.utils.errors import ConfigError

TYPE = "event_camera_msgs::msg::dds_::EventPacket_"


def topic_key(address: Address) -> str:
    """Key of a topic of EventPackets, whatever the hash of their type, from DOMAIN/TOPIC. Raises ConfigError."""
    domain, _, topic = address.place.partition("/")
    topic = topic.strip("/")
    if not domain.isdecimal() or not topic:
        expected = "zenoh://DOMAIN/TOPIC?format=ros2, such as zenoh://0/event_camera/events?format=ros2"
        raise ConfigError(f"{address.text}: {address.place!r} is no domain and topic; expected {expected}")
    return f"{int(domain)}/{topic}/{TYPE}/*"


class PacketReceiver:
    """State of one topic. Its packets are numbered, its events are not: loss is counted in packets."""

    def __init__(self):
        self.size: tuple[int, int] | None = None
        """The sensor's (width, height), once a packet has stated it."""
        self._decoder = PacketDecoder()
        self._next: int | None = None

    def piece(self, data: Sequence[bytes], arrived_s: float) -> Piece:
        """Events of messages that were taken together."""
        found: list[Events] = []
        lost = damaged = 0
        restart = False
        for message in data:
            try:
                one = packet(message, cdr=True)
                if self._next is not None and one.seq < self._next:
                    # Another publisher, or the camera's driver begun anew: its times do not continue those before.
                    self._decoder, self._next, restart = PacketDecoder(), None, True
                events = self._decoder.decode(one)
            except (struct.error, ValueError, LookupError):
                damaged += 1
                continue
            lost += 0 if self._next is None else one.seq - self._next
            restart |= self._next is None
            self._next, self.size = one.seq + 1, one.size
            found.append(events)
        return Piece(
            concatenate([events for events in found if events.count]),
            arrived_s,
            lost_packets=lost,
            damaged=damaged,
            restart=restart,
        )
