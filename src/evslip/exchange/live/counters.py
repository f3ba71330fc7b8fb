"""Counters of a live stream."""

from dataclasses import asdict, dataclass
from typing import Any


@dataclass
class Counters:
    """Numbers of events and answers, and of those that are missing, since the beginning."""

    received: int = 0
    """Events that came."""
    lost: int = 0
    """Events that were sent and did not come; known where the source tells."""
    lost_packets: int = 0
    """Datagrams that this machine threw away, of sources that do not number their events."""
    damaged: int = 0
    """Datagrams that were not understood."""
    foreign: int = 0
    """Events of other senders at the same address, which were left out."""
    late: int = 0
    """Events dropped because the stream had already gone beyond their time."""
    outside: int = 0
    """Events dropped because they lie beyond the sensor."""
    dropped: int = 0
    """Events dropped under overload, unseen by the detector."""
    answers: int = 0
    skipped: int = 0
    """Answers left out under overload, in favour of newer ones."""
    alarms: int = 0
    """How often the detector began to say slip."""
    reconnects: int = 0
    """How often the source came back."""
    restarts: int = 0
    """How often the stream's clock began anew."""
    connected: bool = False
    tells_loss: bool = True
    """Whether `lost` is known."""
    lag_ms: float = 0.0
    """How much later than the quickest of the stream the newest events came."""
    waiting: int = 0
    """Events that wait for the detector."""

    def as_json(self) -> dict[str, Any]:
        """All of them, for a machine; `lost` is null where it is not known."""
        found = asdict(self) | {"lag_ms": round(self.lag_ms, 3)}
        return found | {"lost": self.lost if self.tells_loss else None}

    def line(self) -> str:
        """The counters that matter, for a person."""
        lost = f"{self.lost:,} lost" if self.tells_loss else "loss unknown"
        parts = [f"{self.received:,} events", lost]
        named = {
            "lost_packets": "datagrams thrown away", "damaged": "damaged datagrams",
            "foreign": "of other senders", "late": "late", "outside": "beyond the sensor",
            "dropped": "dropped under overload", "skipped": "answers skipped",
            "reconnects": "reconnects", "restarts": "restarts",
        }  # fmt: skip
        parts += [f"{getattr(self, name):,} {text}" for name, text in named.items() if getattr(self, name)]
        return ", ".join([*parts, f"lag {self.lag_ms:.1f} ms"])
