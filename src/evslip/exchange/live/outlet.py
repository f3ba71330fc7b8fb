"""Answers on their way to a controller, a line of JSON each: by UDP, or as a client of a websocket."""

import contextlib
import queue
import socket
import threading
import time
from typing import Any

from evslip.exchange.live.address import Address
from evslip.exchange.live.transports.udp import resolved
from evslip.utils.errors import ConfigError, MissingExtraError

MOST_WAITING = 256
"""Lines that wait for a slow receiver; of more, the oldest go and are counted."""
AGAIN_S = 0.5
REACH_S = 2.0


class Outlet:
    """Sender of lines to udp://HOST:PORT, a datagram each, or to ws://HOST:PORT/PATH, a message each. It never waits
    for the receiver, which may vanish and come back."""

    def __init__(self, text: str):
        address = Address.of(text)
        self.name, self.dropped = text, 0
        """`dropped`: lines that the receiver did not take in time."""
        self._ends = threading.Event()
        self._waiting: queue.Queue[str] = queue.Queue(MOST_WAITING)
        self._socket = self._thread = None
        if address.scheme == "udp":
            address.option({})
            family, self._place = resolved(address)
            self._socket = socket.socket(family, socket.SOCK_DGRAM)
        elif address.scheme == "ws":
            try:
                import websockets.sync.client as client
            except ImportError:
                raise MissingExtraError(f"{text} needs the package websockets: pip install 'evslip[view]'") from None
            self._client: Any = client
            self._thread = threading.Thread(target=self._run, name="outlet", daemon=True)
            self._thread.start()
        else:
            raise ConfigError(f"to: {text} is unknown; expected udp://HOST:PORT or ws://HOST:PORT/PATH")

    def send(self, line: str) -> None:
        """Send a line, or keep it until the receiver takes it."""
        if self._socket is not None:
            with contextlib.suppress(OSError):  # nobody listens, which is how datagrams are
                self._socket.sendto(line.encode(), self._place)
            return
        while True:
            try:
                self._waiting.put_nowait(line)
                return
            except queue.Full:
                with contextlib.suppress(queue.Empty):
                    self._waiting.get_nowait()
                    self.dropped += 1

    def close(self) -> None:
        if self._socket is not None:
            self._socket.close()
        if self._thread is not None:
            end_s = time.monotonic() + 1.0
            while not self._waiting.empty() and time.monotonic() < end_s:
                time.sleep(0.005)
            self._ends.set()
            self._thread.join(timeout=REACH_S)

    def _run(self) -> None:
        while not self._ends.is_set():
            try:
                with self._client.connect(self.name, open_timeout=REACH_S, close_timeout=0.5) as connection:
                    while not self._ends.is_set():
                        with contextlib.suppress(queue.Empty):
                            connection.send(self._waiting.get(timeout=0.05))
            except Exception:  # of sockets and of the protocol; they have no common base
                self._ends.wait(AGAIN_S)
