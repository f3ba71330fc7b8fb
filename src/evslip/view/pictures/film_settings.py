"""How a film is made. Light to import, for the command line."""

from dataclasses import dataclass
from typing import Literal, get_args

from evslip.utils.errors import ConfigError

MOST_S = 1e9
What = Literal["both", "frames", "events"]


@dataclass(frozen=True)
class FilmSettings:
    """How a film is made."""

    what: What = "both"
    """Events over frames, frames alone, or events alone."""
    speed: float = 0.1
    """Speed of playing, against true time."""
    window_ms: float = 10.0
    """Each picture shows the events of this time before it."""
    start_s: float | None = None
    """First time; default: the beginning of what is recorded."""
    end_s: float | None = None
    """Last time; default: its end."""

    def __post_init__(self) -> None:
        if self.what not in get_args(What):
            raise ConfigError(f"what: {self.what!r}: expected one of {', '.join(get_args(What))}")
        for name, least, most in (("speed", 1e-4, 10.0), ("window_ms", 0.01, 1e5)):
            if not least <= getattr(self, name) <= most:
                raise ConfigError(f"{name}: {getattr(self, name):g} is out of range, expected {least:g} to {most:g}")
        for name in ("start_s", "end_s"):
            value = getattr(self, name)
            if value is not None and not abs(value) <= MOST_S:
                raise ConfigError(f"{name}: {value:g} is out of range, expected {-MOST_S:g} to {MOST_S:g}")
