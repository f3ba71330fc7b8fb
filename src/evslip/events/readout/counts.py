"""Counts of what became of the events in the readout."""

from dataclasses import dataclass

import numpy as np

OFFERED, ADDED, BLOCKED, OVERFLOWED, DROPPED, READ = range(6)
KINDS = ("offered", "added", "blocked", "overflowed", "dropped", "read")


@dataclass(frozen=True)
class ReadoutCounts:
    """Counts of events by their fate, OFF and ON: offered + added = read + blocked + overflowed + dropped + waiting."""

    offered: tuple[int, int]
    """Events that the pixels fired."""
    added: tuple[int, int]
    """Events of bursts."""
    blocked: tuple[int, int]
    """Lost, since their pixels still held an event that was not read."""
    overflowed: tuple[int, int]
    """Lost, since the bus's buffer was full."""
    dropped: tuple[int, int]
    """Lost at random."""
    read: tuple[int, int]
    """Events that came out."""
    waiting: tuple[int, int]
    """Events that have not come out yet."""
    delayed: int
    """Events read a microsecond or more after their pixel fired."""
    mean_delay_us: float
    """Mean over all events read."""
    largest_delay_us: int

    @property
    def lost(self) -> int:
        return sum(self.blocked) + sum(self.overflowed) + sum(self.dropped)

    def summary(self) -> str:
        """One line for a person."""
        offered = sum(self.offered) + sum(self.added)
        return (
            f"readout: {offered:,} events offered, {self.lost:,} lost ({self.lost / max(offered, 1):.1%}), "
            f"{sum(self.waiting):,} still waiting; delay {self.mean_delay_us:.1f} us on average, at most "
            f"{self.largest_delay_us:,} us"
        )

    def totals(self) -> dict[str, int]:
        """Numbers of events, OFF and ON together, and the largest delay, by name."""
        numbers = {f"events_{name}": sum(getattr(self, name)) for name in (*KINDS, "waiting")}
        return numbers | {"events_delayed": self.delayed, "largest_delay_us": self.largest_delay_us}


class Counts:
    """The same, as they change."""

    def __init__(self) -> None:
        self.state = {"table": np.zeros((len(KINDS), 2), np.int64), "delays": np.zeros(3, np.int64)}

    def of(self, kind: int) -> np.ndarray:
        """OFF and ON events of a kind, of shape (2,), for a stage to add to."""
        return self.state["table"][kind]

    def add(self, kind: int, words: np.ndarray) -> None:
        on = int(np.count_nonzero(words & 1))
        self.of(kind)[:] += (len(words) - on, on)

    def add_delays(self, delays_us: np.ndarray) -> None:
        """Count the delays of events that come out, int64 of shape (n,)."""
        delays = self.state["delays"]
        delays[0] += np.count_nonzero(delays_us)
        delays[1] += delays_us.sum()
        delays[2] = max(delays[2], delays_us.max(initial=0))

    def summary(self) -> ReadoutCounts:
        table, delays = self.state["table"], self.state["delays"].tolist()
        lost = table[BLOCKED] + table[OVERFLOWED] + table[DROPPED]
        pairs = {name: (int(off), int(on)) for name, (off, on) in zip(KINDS, table, strict=True)}
        off, on = (table[OFFERED] + table[ADDED] - lost - table[READ]).tolist()
        mean = delays[1] / max(int(table[READ].sum()), 1)
        return ReadoutCounts(
            **pairs, waiting=(off, on), delayed=delays[0], mean_delay_us=mean, largest_delay_us=delays[2]
        )
