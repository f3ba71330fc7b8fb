"""What a run of `generate` tells while it goes on."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from evslip.generation import Made


class Progress:
    """Override what you want to hear."""

    def begin(self, count: int, skipped: int) -> None:
        """Once, at first: `count` samples are wanted, of which an earlier run had finished `skipped`."""

    def made(self, made: "Made") -> None:
        """After every sample."""

    def notice(self, text: str) -> None:
        """When a node or a worker was lost, or a sample cannot be made; one line."""
