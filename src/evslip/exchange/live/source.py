"""Base of all live sources of events."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Self

from evslip.events.stream import Events
from evslip.utils.errors import DataError

GONE_S = 1.0
"""Silence after which a sender that may not be silent is taken to have gone."""


class Unreachable(DataError):
    """A live source does not answer, or has gone. It may come back."""


class Ended(Exception):
    """A live source has said that nothing more will come."""


@dataclass(frozen=True)
class Piece:
    """Events that a source gives at once."""

    events: Events
    """May be none. Not checked: `feed.Feed` does that."""
    arrived_s: float
    """When the last of it came, by time.monotonic()."""
    until_us: int | None = None
    """Time up to which the stream is known, if the source says so: silence, where events end before it."""
    lost: int = 0
    """Events that were sent before these and did not come; negative: of those counted, so many came after all."""
    lost_packets: int = 0
    """Datagrams that this machine threw away, of sources that do not number their events."""
    damaged: int = 0
    """Datagrams that were not understood."""
    restart: bool = False
    """Whether the sender, or its clock, has begun anew: times and numbers do not continue those before."""
    foreign: int = 0
    """Events of other senders at the same place, which were left out."""
    size: tuple[int, int] | None = None
    """The sensor's (width, height) when they came, as far as it was known; `feed.Feed` fills it in."""


class LiveSource(ABC):
    """A source of events that may vanish and come back. A context manager; `open` may be called again after `close`."""

    name: str
    """Address, as the user gave it."""
    tells_loss = True
    """Whether loss on the way is known, by numbers or by a transport that loses nothing."""
    may_be_silent = True
    """Whether nothing for a while is no sign that the source has gone, because that shows otherwise."""

    _size: tuple[int, int] | None = None

    @property
    def size(self) -> tuple[int, int] | None:
        """The sensor's (width, height) as the source has stated it; None: it does not, or has not yet."""
        return self._size

    @abstractmethod
    def open(self) -> None:
        """Begin. Raises Unreachable for what may be there later, ConfigError and DataError for what will not."""

    @abstractmethod
    def read(self, timeout_s: float) -> Piece | None:
        """The next piece, at the latest after the timeout; None for nothing. Raises Unreachable when the source has
        gone, Ended when it is over."""

    @abstractmethod
    def close(self) -> None:
        """End; does nothing if it is not open."""

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
