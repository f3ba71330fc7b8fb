"""A file of events at its own pace, as if it came from a camera."""

import time
from collections.abc import Iterator

from evslip.data.record_file import open_recording
from evslip.events.stream import Events, concatenate
from evslip.exchange.live.address import Address
from evslip.exchange.live.pacing import Pace
from evslip.exchange.live.source import Ended, LiveSource, Piece


class FileSource(LiveSource):
    """A record or a file of events of any known format."""

    def __init__(self, address: Address):
        self.name = address.text
        record, _ = open_recording(self.name)
        self._size = record.size
        self._pace = Pace()
        self._slices: Iterator[tuple[Events, int]] | None = None
        self._next: tuple[Events, int] | None = None

    def open(self) -> None:
        self._pace = Pace()
        self._slices = self._pace.slices(lambda: open_recording(self.name)[1], self.name)
        self._next = None

    def close(self) -> None:
        self._slices = None

    def read(self, timeout_s: float) -> Piece | None:
        assert self._slices is not None
        found: list[Events] = []
        until_us = None
        latest_s = time.monotonic() + timeout_s
        while True:
            self._next = self._next or next(self._slices, None)
            if self._next is None:
                break
            events, end_us = self._next
            due_s, now_s = self._pace.due_s(end_us), time.monotonic()
            if due_s > now_s:
                if found or due_s > latest_s:
                    break
                time.sleep(due_s - now_s)
            found.append(events)
            until_us, self._next = end_us, None
        if until_us is not None:
            return Piece(concatenate(found), time.monotonic(), until_us)
        if self._next is None:
            raise Ended
        time.sleep(timeout_s)
        return None
