"""Live sources of events, and the senders that they hear.

Begin with `source.LiveSource` (what gives events), `target.EventTarget` (what takes them) and `feed.Feed` (a source in
a thread of its own that counts, checks and comes back).
A new transport is a file with a source, a target or both, and a line in SOURCES or TARGETS.
"""

from collections.abc import Callable

from evslip.exchange.live.address import Address
from evslip.exchange.live.source import LiveSource
from evslip.exchange.live.target import EventTarget
from evslip.utils.errors import ConfigError
from evslip.utils.plugins import load

SOURCES = {
    "file": "evslip.exchange.live.transports.file:FileSource",
    "dv": "evslip.exchange.live.transports.dv:DvSource",
    "udp": "evslip.exchange.live.transports.udp:UdpSource",
    "zenoh": "evslip.exchange.live.transports.zenoh:ZenohSource",
    "usb": "evslip.exchange.live.transports.usb:UsbSource",
}
"""Class of the source of each scheme."""
TARGETS = {
    "dv": "evslip.exchange.live.transports.dv:DvTarget",
    "udp": "evslip.exchange.live.transports.udp:UdpTarget",
    "zenoh": "evslip.exchange.live.transports.zenoh:ZenohTarget",
}
"""Class of the target of each scheme."""


def make_source(text: str) -> LiveSource:
    """The source at an address, not yet open. Raises ConfigError, MissingExtraError."""
    return _class_of(text, SOURCES, "a source of events")


def make_target(text: str, size: tuple[int, int]) -> EventTarget:
    """The target at an address, for events of a sensor of `size` (width, height). Raises ConfigError, DataError,
    MissingExtraError."""
    return _class_of(text, TARGETS, "a target of events", size)


def _class_of(text: str, register: dict[str, str], what: str, *more: object):
    address = Address.of(text)
    if address.scheme not in register:
        known = ", ".join(f"{name}://" for name in register if name != "file")
        also = "a file of events, " if "file" in register else ""
        raise ConfigError(f"{text}: is not {what}; expected {also}{known}")
    make: Callable = load(register[address.scheme])
    return make(address, *more)
