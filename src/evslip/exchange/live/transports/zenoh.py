"""Events over zenoh: evslip's datagrams under a key, or a topic of ROS 2, which may run on it."""

import contextlib
import queue
import secrets
import time
from typing import Any

from evslip.events.stream import Events
from evslip.exchange.live.address import Address
from evslip.exchange.live.source import LiveSource, Piece, Unreachable
from evslip.exchange.live.target import EventTarget
from evslip.exchange.live.transports.datagrams import Receiver
from evslip.exchange.live.transports.packet import Packer
from evslip.exchange.live.transports.packets import PacketReceiver, topic_key
from evslip.utils.errors import ConfigError, MissingExtraError

MOST_WAITING = 4_096
"""Messages that wait to be read; more are thrown away, which their numbers tell."""
MOST_AT_ONCE = 512
MESSAGE_BYTES = 65_536
FORMATS = ("evslip", "ros2")


def open_session(address: Address) -> Any:
    """A session of zenoh. `connect` among the options is the place of a router or peer, `listen` one to be found at;
    default: what zenoh finds on the network. Raises ConfigError, Unreachable, MissingExtraError."""
    try:
        import zenoh
    except ImportError as error:
        raise MissingExtraError(f"zenoh:// needs eclipse-zenoh ({error}): pip install 'evslip[live]'") from None
    config = zenoh.Config()
    for name, place in address.options.items():
        if name == "format":
            continue
        _set(zenoh, config, f"{name}/endpoints", f'["{place}"]', address)
        _set(zenoh, config, "scouting/multicast/enabled", "false", address)
    try:
        zenoh.KeyExpr(address.place)
    except Exception:
        raise ConfigError(f"{address.text}: expected zenoh://KEY, such as zenoh://robot/events") from None
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        raise Unreachable(f"{address.text}: nobody answers ({' '.join(str(error).split())[:120]})") from None


def check_options(address: Address, formats: tuple[str, ...] = FORMATS) -> None:
    """Raise ConfigError for options that are none."""
    for name, value in address.options.items():
        if name not in ("connect", "listen", "format"):
            raise ConfigError(
                f"{address.text}: {name} is unknown; expected connect or listen, such as tcp/HOST:7447, or format"
            )
        if name == "format" and value not in formats:
            raise ConfigError(f"{address.text}: format {value!r} is unknown; expected {' or '.join(formats)}")


def _set(zenoh: Any, config: Any, key: str, value: str, address: Address) -> None:
    try:
        config.insert_json5(key, value)
    except zenoh.ZError:
        raise ConfigError(f"{address.text}: {value} is no place; expected such as tcp/127.0.0.1:7447") from None


class ZenohSource(LiveSource):
    """Subscriber to a key. Loss is known to the event; of a topic of ROS 2, to the packet."""

    may_be_silent = False

    def __init__(self, address: Address):
        self.name, self._address = address.text, address
        check_options(address)
        self._session: Any = None
        is_ros2 = address.options.get("format") == "ros2"
        self._key, self.tells_loss = (topic_key(address), False) if is_ros2 else (address.place, True)
        self._receiver = PacketReceiver() if is_ros2 else Receiver()
        self._waiting: queue.Queue[bytes] = queue.Queue(MOST_WAITING)

    @property
    def size(self) -> tuple[int, int] | None:
        return self._receiver.size

    def open(self) -> None:
        self.close()
        self._session = open_session(self._address)
        self._session.declare_subscriber(self._key, self._take)

    def close(self) -> None:
        if self._session is not None:
            self._session.close()
        self._session = None

    def _take(self, sample: Any) -> None:
        with contextlib.suppress(queue.Full):  # the next datagram's number tells how many events went
            self._waiting.put_nowait(sample.payload.to_bytes())

    def read(self, timeout_s: float) -> Piece | None:
        try:
            found = [self._waiting.get(timeout=timeout_s)]
        except queue.Empty:
            return None
        while len(found) < MOST_AT_ONCE:
            try:
                found.append(self._waiting.get_nowait())
            except queue.Empty:
                break
        return self._receiver.piece(found, time.monotonic())


class ZenohTarget(EventTarget):
    """Publisher under a key."""

    def __init__(self, address: Address, size: tuple[int, int]):
        self.name = address.text
        check_options(address, FORMATS[:1])
        self._session = open_session(address)
        self._publisher = self._session.declare_publisher(address.place)
        self._packer = Packer(size, secrets.randbits(64), MESSAGE_BYTES)
        self._until_us = 0

    def send(self, events: Events, until_us: int) -> None:
        self._until_us = until_us
        for datagram in self._packer.pack(events, until_us):
            self._publisher.put(datagram)

    def close(self) -> None:
        self._publisher.put(self._packer.end(self._until_us))
        self._session.close()
