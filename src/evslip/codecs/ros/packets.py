"""Events of the messages event_camera_msgs/EventPacket, which the drivers of metavision and libcaer for ROS send.

Encodings, after the README of https://github.com/ros-event-camera/event_camera_msgs: evt3, Prophesee's words as the
sensor sends them, on the sensor's own clock (time_base means nothing there); mono, 8 bytes an event: 32 bits of
nanoseconds after time_base, 16 of x, 15 of y, one of polarity; libcaer, 8 bytes: polarity, y, x, then 32 bits of
microseconds after time_base. Packets of triggers hold no events.
"""

import numpy as np

from evslip.codecs.prophesee import evt3
from evslip.codecs.ros.messages import Packet
from evslip.codecs.source import events_of
from evslip.events.stream import Events, empty_events

ENCODINGS = ("evt3", "mono", "libcaer", "trigger")
LATEST_NS = 2**62
"""Latest time base, so that times after it fit into 64 bits with a sign: the year 2116."""


class PacketDecoder:
    """Events of packets that come one after another. Raises ValueError for what cannot be decoded."""

    def __init__(self) -> None:
        self._evt3 = evt3.Decoder()
        self._next_seq: int | None = None

    def decode(self, packet: Packet) -> Events:
        kind = packet.encoding
        if kind not in ENCODINGS:
            raise ValueError(f"events in the encoding {kind[:20]!r}; known are {', '.join(ENCODINGS)}")
        if kind == "trigger":
            return empty_events()
        if kind == "evt3":
            return self._words(packet)
        if packet.time_base > LATEST_NS:
            raise ValueError(f"a time base of {packet.time_base} ns, expected {LATEST_NS} at most")
        words = np.frombuffer(packet.content, "<u8")
        if kind == "mono":
            t_us = (packet.time_base + (words & 0xFFFFFFFF).astype(np.int64)) // 1000
            return events_of(t_us, words >> 32 & 0xFFFF, words >> 48 & 0x7FFF, words >> 63)
        counter = (words >> 32).astype(np.int64)
        # A counter of 31 bits, which wraps within a packet; time_base has its upper half.
        t_us = packet.time_base // 1000 + counter + (np.cumsum(np.diff(counter, prepend=0) < 0) << 31)
        return events_of(t_us, words >> 17 & 0x7FFF, words >> 2 & 0x7FFF, words >> 1 & 1)

    def _words(self, packet: Packet) -> Events:
        words = np.frombuffer(packet.content, "<u2")
        if self._next_seq not in (None, packet.seq):
            self._evt3.skip()
        self._next_seq = packet.seq + 1
        return self._evt3.decode(words)
