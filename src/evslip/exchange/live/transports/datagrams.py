"""Receiver of evslip's datagrams, whatever carries them: puts them in order and counts what is missing."""

from collections import deque
from collections.abc import Sequence

from evslip.events.stream import concatenate
from evslip.exchange.live.source import GONE_S, Piece
from evslip.exchange.live.transports.packet import Datagram, unpack

MOST_FORMER = 64
"""Streams that are remembered."""


class Receiver:
    """State of one stream: its sender, and how many events it has sent so far.

    A sender that was never heard before takes the place of the one before it, which has most often been started anew.
    One that was replaced and still sends is left out until the present one is over: two senders do not take turns.
    """

    def __init__(self):
        self.size: tuple[int, int] | None = None
        """The sensor's (width, height), once a datagram has stated it."""
        self._stream: int | None = None
        self._number = 0
        self._heard_s = 0.0
        self._is_over = False
        self._former = deque[int](maxlen=MOST_FORMER)

    def piece(self, data: Sequence[bytes], arrived_s: float) -> Piece:
        """Events of datagrams that were taken together."""
        found = [datagram for datagram in map(unpack, data) if datagram is not None]
        damaged = len(data) - len(found)
        stream = self._chosen(found, arrived_s)
        own = sorted((one for one in found if one.stream == stream), key=lambda one: one.number)
        foreign = sum(one.events.count for one in found if one.stream != stream)
        if not own:
            return Piece(concatenate([]), arrived_s, damaged=damaged, foreign=foreign)
        restart = stream != self._stream
        if restart:
            if self._stream is not None:
                self._former.append(self._stream)
            self._stream, self._number = stream, own[0].number
        lost = 0
        for one in own:
            # A datagram that comes late has been counted as lost; its events count as late from now on.
            lost += one.number - self._number if one.number >= self._number else -one.events.count
            self._number = max(self._number, one.number + one.events.count)
        self.size, self._heard_s, self._is_over = own[-1].size, arrived_s, any(one.ends for one in own)
        until_us = max(one.until_us for one in own)
        events = concatenate([one.events for one in own if one.events.count])
        return Piece(events, arrived_s, until_us, lost, 0, damaged, restart, foreign)

    def _chosen(self, found: Sequence[Datagram], arrived_s: float) -> int | None:
        """The stream whose datagrams are taken: the last one of them that was not replaced before. One that was begins
        anew where the present one is over, but not by saying that it ends."""
        is_over = self._is_over or arrived_s - self._heard_s > GONE_S
        may_come = (
            one.stream for one in reversed(found) if one.stream not in self._former or (is_over and not one.ends)
        )
        return next(may_come, self._stream)
