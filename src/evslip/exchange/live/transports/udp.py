"""Events in datagrams."""

import contextlib
import errno
import secrets
import select
import socket
import struct
import time

from evslip.events.stream import Events, concatenate
from evslip.exchange.live.address import Address
from evslip.exchange.live.source import LiveSource, Piece
from evslip.exchange.live.target import EventTarget
from evslip.exchange.live.transports.datagrams import Receiver
from evslip.exchange.live.transports.packet import Packer, pack_faery, unpack_faery
from evslip.utils.errors import ConfigError, DataError

FORMATS = ("evslip", "faery")
BUFFER_BYTES = 32 << 20
"""Bytes that the kernel shall keep while nobody reads; it may grant less."""
MOST_BYTES = 65_536
MOST_AT_ONCE = 512
"""Datagrams that are taken together."""
LOCAL_BYTES, NETWORK_BYTES = 8_192, 1_400
"""Lengths of datagrams to this machine, and to others, through whose networks longer ones would go in pieces."""
SO_RXQ_OVFL = 40
"""Linux: every datagram comes with the number that the socket has thrown away so far."""
ENDS = 3
"""How often the end is said: datagrams get lost."""


def resolved(address: Address) -> tuple[socket.AddressFamily, tuple]:
    """Family and address of a socket. Raises ConfigError for a name that is unknown."""
    host, port = address.host_and_port()
    try:
        family, _, _, _, place = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
    except (OSError, UnicodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "no name of a machine"
        raise ConfigError(f"{address.text}: {host} is not known ({reason}), expected HOST:PORT") from None
    return family, place


class UdpSource(LiveSource):
    """Datagrams that come to a port of this machine. Of evslip's format, loss is known to the event; of faery's, only
    what this machine has thrown away, in datagrams."""

    may_be_silent = False

    def __init__(self, address: Address):
        self.name = address.text
        self._is_faery = address.option({"format": FORMATS})["format"] == "faery"
        self.tells_loss = not self._is_faery
        self._family, self._place = resolved(address)
        self._socket: socket.socket | None = None
        self._receiver, self._overflow = Receiver(), 0
        self._buffer = memoryview(bytearray(MOST_BYTES))

    @property
    def size(self) -> tuple[int, int] | None:
        return self._receiver.size

    def open(self) -> None:
        self.close()
        opened = socket.socket(self._family, socket.SOCK_DGRAM)
        try:
            for option in (33, socket.SO_RCVBUF):  # 33: SO_RCVBUFFORCE, which only the administrator may set
                with contextlib.suppress(OSError):
                    opened.setsockopt(socket.SOL_SOCKET, option, BUFFER_BYTES)
                    break
            with contextlib.suppress(OSError):
                opened.setsockopt(socket.SOL_SOCKET, SO_RXQ_OVFL, 1)
            opened.bind(self._place)
        except OSError as error:
            opened.close()
            raise ConfigError(
                f"{self.name}: cannot be listened to ({error.strerror}); expected an address of this machine, such as "
                "0.0.0.0, and a free port"
            ) from None
        opened.setblocking(False)
        self._socket, self._overflow = opened, 0

    def close(self) -> None:
        if self._socket is not None:
            self._socket.close()
        self._socket = None

    def read(self, timeout_s: float) -> Piece | None:
        assert self._socket is not None
        if not select.select([self._socket], [], [], timeout_s)[0]:
            return None
        datagrams, overflow = self._take(self._socket)
        thrown, self._overflow = (overflow - self._overflow) & 0xFFFFFFFF, overflow
        arrived_s = time.monotonic()
        return (
            self._faery(datagrams, arrived_s, thrown) if self._is_faery else self._receiver.piece(datagrams, arrived_s)
        )

    def _take(self, opened: socket.socket) -> tuple[list[bytes], int]:
        found, overflow = [], self._overflow
        for _ in range(MOST_AT_ONCE):
            try:
                length, ancillary, _, _ = opened.recvmsg_into([self._buffer], 64)
            except BlockingIOError:
                break
            found.append(bytes(self._buffer[:length]))
            if ancillary and ancillary[0][1] == SO_RXQ_OVFL:
                (overflow,) = struct.unpack("=I", ancillary[0][2][:4])
        return found, overflow

    def _faery(self, datagrams: list[bytes], arrived_s: float, thrown: int) -> Piece:
        parts = [unpack_faery(data) for data in datagrams]
        whole = [part for part in parts if part is not None and part.count]
        return Piece(concatenate(whole), arrived_s, lost_packets=thrown, damaged=sum(part is None for part in parts))


class UdpTarget(EventTarget):
    """Sender of datagrams in evslip's format, or faery's."""

    def __init__(self, address: Address, size: tuple[int, int]):
        self.name = address.text
        chosen = address.option({"format": FORMATS, "bytes": ("auto", *map(str, range(64, 65_508)))})
        self._is_faery = chosen["format"] == "faery"
        family, self._place = resolved(address)
        if not self._is_faery and not (size[0] <= 65_535 and size[1] <= 32_768):
            raise DataError(f"{self.name}: a sensor of {size[0]}x{size[1]} pixels, expected at most 65535x32768")
        own = self._place[0].startswith("127.") or self._place[0] == "::1"
        automatic = LOCAL_BYTES if own else NETWORK_BYTES
        self._most = automatic if chosen["bytes"] == "auto" else int(chosen["bytes"])
        self._packer = Packer(size, secrets.randbits(64), self._most)
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._until_us = 0

    def send(self, events: Events, until_us: int) -> None:
        self._until_us = until_us
        if not self._is_faery:
            datagrams = self._packer.pack(events, until_us)
        elif events.count and events.t_us[0] < 0:
            raise DataError(f"{self.name}: an event at {events.t_us[0]} us; expected none before 0 in faery's format")
        else:
            datagrams = pack_faery(events, self._most)
        for datagram in datagrams:
            self._put(datagram)

    def close(self) -> None:
        if not self._is_faery and self._socket.fileno() >= 0:
            for _ in range(ENDS):
                self._put(self._packer.end(self._until_us))
        self._socket.close()

    def _put(self, datagram: bytes) -> None:
        try:
            self._socket.sendto(datagram, self._place)
        except OSError as error:
            # Nobody listens, or the way is closed for a while: what a datagram is allowed to meet.
            if error.errno not in (errno.ECONNREFUSED, errno.ENOBUFS, errno.ENETUNREACH, errno.EHOSTUNREACH):
                raise DataError(f"{self.name}: cannot be sent to ({error.strerror})") from None
