"""Pieces that have come and were not yet taken, bounded."""

import threading
from collections import deque
from dataclasses import replace

from evslip.exchange.live.source import Piece

MOST_EVENTS = 4_000_000
"""Events that may wait: some 50 MB."""


class Backlog:
    """Pieces that wait to be taken. Of more than so many events the oldest pieces go, and are counted."""

    def __init__(self, most_events: int = MOST_EVENTS):
        self._most, self._pieces = most_events, deque[Piece]()
        self._changed = threading.Condition()
        self.waiting = self.dropped = 0
        self._closed = False

    def put(self, piece: Piece) -> None:
        with self._changed:
            self._pieces.append(piece)
            self.waiting += piece.events.count
            while self.waiting > self._most and len(self._pieces) > 1:
                oldest = self._pieces.popleft()
                self.waiting -= oldest.events.count
                self.dropped += oldest.events.count
                if oldest.restart:
                    self._pieces[0] = replace(self._pieces[0], restart=True)
            self._changed.notify()

    def take(self, timeout_s: float) -> list[Piece]:
        """All pieces that wait, at the latest after the timeout."""
        with self._changed:
            if not self._pieces and not self._closed:
                self._changed.wait(timeout_s)
            found = list(self._pieces)
            self._pieces.clear()
            self.waiting = 0
            return found

    def close(self) -> None:
        """Nothing more will be put: nobody shall wait."""
        with self._changed:
            self._closed = True
            self._changed.notify()
