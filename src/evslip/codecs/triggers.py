"""Triggers, which cameras record beside their events: edges at their inputs, and marks of their own frames.

A codec that can read them has `triggers(path) -> Iterator[Triggers]`, with a camera where its files may have several.
"""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from evslip.codecs.formats import format_of

KINDS = (
    "reset of the clock",
    "rising",
    "falling",
    "pulse",
    "rising (generator)",
    "falling (generator)",
    "begin of a frame",
    "end of a frame",
    "begin of an exposure",
    "end of an exposure",
)
"""Names of the kinds of triggers, in the order of AEDAT4's numbers."""
FALLING, RISING = 2, 1


class Triggers(NamedTuple):
    """A piece of a file's triggers."""

    t_us: np.ndarray
    """Times in microseconds, int64 of shape (n,)."""
    kind: np.ndarray
    """Index in KINDS, of shape (n,); a greater one is unknown."""
    channel: np.ndarray
    """Number of the input, of shape (n,); 0 in formats that do not tell it."""


@dataclass(frozen=True)
class TriggerFacts:
    """Numbers of a file's triggers."""

    count: int
    start_us: int
    """Times of the earliest and the latest; 0 if there is none."""
    end_us: int
    kinds: dict[str, int]
    """Number of triggers of each kind that there is."""
    channels: dict[int, int]
    """Number of triggers of each input."""

    def __str__(self) -> str:
        if not self.count:
            return "none"
        kinds = ", ".join(f"{number:,} {name}" for name, number in self.kinds.items())
        inputs = f"; inputs {', '.join(map(str, self.channels))}" if set(self.channels) != {0} else ""
        return f"{self.count:,}: {kinds}; from {self.start_us} to {self.end_us} us{inputs}"


def trigger_facts(path: str | Path, camera: str | None = None) -> TriggerFacts | None:
    """Numbers of the triggers in a file; None for a format whose triggers are not read. camera: as of `open_events`.
    Raises DataError."""
    read = getattr(format_of(path).codec, "triggers", None)
    if read is None:
        return None
    kinds, channels, start_us, end_us = Counter[int](), Counter[int](), 0, 0
    for part in read(Path(path)) if camera is None else read(Path(path), camera):
        if len(part.t_us):
            first, last = int(part.t_us.min()), int(part.t_us.max())
            start_us, end_us = (min(start_us, first), max(end_us, last)) if kinds else (first, last)
            kinds.update(part.kind.tolist())
            channels.update(part.channel.tolist())
    named = {KINDS[kind] if kind < len(KINDS) else f"of kind {kind}": kinds[kind] for kind in sorted(kinds)}
    return TriggerFacts(kinds.total(), start_us, end_us, named, dict(sorted(channels.items())))


def left_out(path: str | Path, camera: str | None = None) -> str:
    """Words for the triggers that a file holds, such as "12 triggers", or nothing. camera: as of `open_events`. Raises
    DataError."""
    facts = trigger_facts(path, camera)
    return f"{facts.count:,} triggers" if facts is not None and facts.count else ""
