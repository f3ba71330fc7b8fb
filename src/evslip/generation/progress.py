"""What a run of `generate` tells while it goes on."""

from typing import NamedTuple

from evslip.data.journal import Entry


class Made(NamedTuple):
    """What became of a job."""

    entry: Entry
    """The journal's line."""
    seconds: dict[str, float]
    """Processor seconds by stage."""


class Progress:
    """Override what you want to hear."""

    def begin(self, count: int, skipped: int) -> None:
        """Once, at first: `count` samples are wanted, of which an earlier run had finished `skipped`."""

    def made(self, made: Made) -> None:
        """After every sample."""

    def notice(self, text: str) -> None:
        """When a node or a worker was lost, or a sample cannot be made; one line."""
