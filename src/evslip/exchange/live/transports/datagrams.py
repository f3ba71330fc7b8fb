"""Receiver of evslip's datagrams, whatever carries them: puts them in order and counts what is missing."""

from collections.abc import Sequence

from evslip.events.stream import concatenate
from evslip.exchange.live.source import Piece
from evslip.exchange.live.transports.packet import unpack


class Receiver:
    """State of one stream: its sender, and how many events it has sent so far."""

    def __init__(self):
        self.size: tuple[int, int] | None = None
        """The sensor's (width, height), once a datagram has stated it."""
        self._stream: int | None = None
        self._number = 0

    def piece(self, data: Sequence[bytes], arrived_s: float) -> Piece:
        """Events of datagrams that were taken together."""
        found = [datagram for datagram in map(unpack, data) if datagram is not None]
        damaged = len(data) - len(found)
        if not found:
            return Piece(concatenate([]), arrived_s, damaged=damaged)
        newest = found[-1].stream
        # An older sender's last datagrams beside a new one's first: their events are given up, and counted.
        lost = sum(one.events.count for one in found if one.stream != newest)
        of_newest = sorted((one for one in found if one.stream == newest), key=lambda one: one.number)
        restart = newest != self._stream
        if restart:
            self._stream, self._number = newest, of_newest[0].number
        for one in of_newest:
            # A datagram that comes late has been counted as lost; its events count as late from now on.
            lost += one.number - self._number if one.number >= self._number else -one.events.count
            self._number = max(self._number, one.number + one.events.count)
        self.size = of_newest[-1].size
        until_us = max(one.until_us for one in of_newest)
        events = concatenate([one.events for one in of_newest if one.events.count])
        return Piece(events, arrived_s, until_us, lost, 0, damaged, restart)
