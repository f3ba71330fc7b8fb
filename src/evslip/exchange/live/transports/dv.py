"""Events by the network stream of DV and dv-processing: TCP, a server that sends, clients that read."""

import contextlib
import os
import socket
import stat
import time
from pathlib import Path
from typing import Any

import numpy as np

from evslip.codecs.source import events_of
from evslip.events.stream import Events
from evslip.exchange.live.address import Address
from evslip.exchange.live.source import LiveSource, Piece, Unreachable
from evslip.exchange.live.target import EventTarget
from evslip.utils.errors import ConfigError, DataError, MissingExtraError

LOOK_S = 0.0005
"""Time between two looks for a new batch."""
REACH_S = 0.5
"""Longest time to reach a server."""
STUCK_S = 2.0
"""Time without a packet taken after which readers are given up."""
MOST_CLIENTS = 10
MOST_BATCHES = 200
"""Batches that are taken together."""


def dv_processing() -> Any:
    """The package dv_processing. Raises MissingExtraError."""
    try:
        import dv_processing as package
    except ImportError as error:
        raise MissingExtraError(f"dv:// needs dv-processing ({error}): pip install 'evslip[live]'") from None
    return package


class DvSource(LiveSource):
    """Client of a server of dv-processing, such as a camera opened in DV, or `evslip stream FILE dv://...`."""

    def __init__(self, address: Address):
        self.name = address.text
        address.option({})
        self._host, self._port = address.host_and_port()
        self._package, self._reader = dv_processing(), None

    def open(self) -> None:
        self.close()
        try:
            # The package waits for ever, with the interpreter's lock, for a server that is none: so this asks before.
            with socket.create_connection((self._host, self._port), REACH_S) as tried:
                if not tried.recv(1):
                    raise OSError("it closes the connection")
            reader = self._package.io.NetworkReader(socket.gethostbyname(self._host), self._port)
        except (OSError, UnicodeError, RuntimeError) as error:
            reason = getattr(error, "strerror", None) or " ".join(str(error).split())[:120]
            raise Unreachable(f"{self.name}: nobody answers ({reason})") from None
        resolution = reader.getEventResolution() if reader.isEventStreamAvailable() else None
        if resolution is None:
            raise DataError(f"{self.name}: sends no events, expected a stream of events with its resolution")
        self._reader, self._size = reader, (int(resolution[0]), int(resolution[1]))

    def close(self) -> None:
        self._reader = None

    def read(self, timeout_s: float) -> Piece | None:
        end_s, found = time.monotonic() + timeout_s, []
        while len(found) < MOST_BATCHES:
            try:
                batch = self._batch()
            except Unreachable:
                if not found:
                    raise
                break  # what came before is returned first; the next call finds the server gone again
            if batch is not None:
                found.append(batch)
            elif found or time.monotonic() >= end_s:
                break
            else:
                time.sleep(LOOK_S)
        if not found:
            return None
        rows = np.concatenate(found)
        return Piece(events_of(rows["timestamp"], rows["x"], rows["y"], rows["polarity"]), time.monotonic())

    def _batch(self) -> np.ndarray | None:
        reader: Any = self._reader
        try:
            is_over = not reader.isRunning()  # asked first: what came before the end is there then
            batch = reader.getNextEventBatch()
        except RuntimeError as error:
            raise Unreachable(f"{self.name}: broke off ({' '.join(str(error).split())[:120]})") from None
        if batch is None and is_over:
            raise Unreachable(f"{self.name}: has gone")
        return None if batch is None or batch.isEmpty() else batch.numpy()


class DvTarget(EventTarget):
    """Server of dv-processing's network stream, which sends to all who are connected."""

    def __init__(self, address: Address, size: tuple[int, int]):
        self.name = address.text
        address.option({})
        host, port = address.host_and_port()
        self._package, self._port = dv_processing(), port
        if max(size) > 32_767:
            raise DataError(f"{self.name}: a sensor of {size[0]}x{size[1]} pixels, expected at most 32767 in a row")
        stream = self._package.io.Stream.EventStream(0, "events", "evslip", size)
        try:
            with contextlib.closing(socket.socket()) as tried:
                tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                tried.bind((socket.gethostbyname(host), port))
            # Its default handler writes to the terminal when a client leaves, which clients may do.
            self._writer = self._package.io.NetworkWriter(
                socket.gethostbyname(host), port, stream, MOST_CLIENTS, lambda *_: None
            )
        except (OSError, UnicodeError, RuntimeError) as error:
            reason = getattr(error, "strerror", None) or " ".join(str(error).split())[:120]
            raise ConfigError(
                f"{self.name}: no server can be there ({reason}); expected an address of this machine and a free port"
            ) from None

    @property
    def clients(self) -> int:
        return self._writer.getClientCount()

    def send(self, events: Events, until_us: int) -> None:
        if not events.count:
            return
        store = self._package.EventStore()
        add = store.push_back
        for row in zip(*(column.tolist() for column in events.columns), strict=True):
            add(row)
        self._writer.writeEvents(store)

    def close(self) -> None:
        self._wait_for_readers()
        # The package's destructor never ends while somebody is connected: it waits, with the interpreter's lock, for a
        # thread that waits for this lock to report them. So readers are disconnected before.
        end_s = time.monotonic() + STUCK_S
        while self.clients and time.monotonic() < end_s:
            _disconnect(self._port)
            time.sleep(LOOK_S)

    def _wait_for_readers(self) -> None:
        """Until all is on its way, or readers have taken nothing for a while."""
        queued, moved_s = self._writer.getQueuedPacketCount(), time.monotonic()
        while self.clients and queued and time.monotonic() - moved_s < STUCK_S:
            time.sleep(LOOK_S)
            left = self._writer.getQueuedPacketCount()
            if left < queued:
                queued, moved_s = left, time.monotonic()
        if self.clients:
            time.sleep(0.05)  # the last packet has left the queue, and is on its way


def _disconnect(port: int) -> None:
    """Shut this process's connections at a port of its own, once what was written to them is on its way."""
    for number in [int(path.name) for path in Path("/proc/self/fd").iterdir()]:
        with contextlib.suppress(OSError):
            if not stat.S_ISSOCK(os.fstat(number).st_mode):
                continue
            with socket.socket(fileno=os.dup(number)) as one:
                if one.getsockname()[1:2] == (port,) and one.getpeername():
                    one.shutdown(socket.SHUT_RDWR)
