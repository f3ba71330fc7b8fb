"""Base of all targets of a sender."""

from abc import abstractmethod
from contextlib import AbstractContextManager

from evslip.events.stream import Events


class EventTarget(AbstractContextManager):
    """A place that events are sent to. A context manager."""

    @abstractmethod
    def send(self, events: Events, until_us: int) -> None:
        """Send events, in order of time, none of them from before the last call's until_us. The stream is known up to
        until_us, also where there are none. Raises DataError."""

    @abstractmethod
    def close(self) -> None:
        """Say that nothing more will come, as far as the transport can."""

    def __exit__(self, *_: object) -> None:
        self.close()
