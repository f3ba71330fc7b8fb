"""Score of simulated events against real ones of the same scene; docs/explanation/realism.md defines each figure."""

import math
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any, NamedTuple

import numpy as np

from evslip.data.footage import Footage
from evslip.events.intervals import intervals_us
from evslip.events.stream import Events
from evslip.learn.documents import plain
from evslip.learn.realism import timing, two_sample
from evslip.learn.realism.cells import Agreement, Cells, agreement, counts
from evslip.learn.realism.levels import NAMES, LevelRates, rates_by_level
from evslip.learn.realism.oracle import frame_counts
from evslip.utils.errors import DataError

FINE, COARSE = (4, 40_000), (8, 80_000)
"""Sides of cells in pixels, and their durations in us."""


class Pair(NamedTuple):
    """Real and simulated events of the same scene, on one clock."""

    real: Events
    simulated: Events
    size: tuple[int, int]
    start_us: int
    end_us: int
    footage: Footage | None = None
    """The recording's frames."""
    other_draw: Events | None = None
    """Events of the simulated sensor with another seed."""

    def within(self) -> "Pair":
        """The stretch that is scored alone."""
        cut = {name: getattr(self, name) for name in ("real", "simulated", "other_draw")}
        return self._replace(
            **{name: events and events.between(self.start_us, self.end_us) for name, events in cut.items()}
        )


@dataclass(frozen=True, kw_only=True)
class Realism:
    """Figures of a pair; nan where a figure is not defined, None where it was not asked for or lacks what it needs."""

    fine: Agreement
    """In cells of 4 x 4 pixels and 40 ms."""
    coarse: Agreement
    """In cells of 8 x 8 pixels and 80 ms."""
    floor: Agreement | None
    """Agreement of two draws of the simulated sensor, fine."""
    floor_coarse: Agreement | None
    oracle: Agreement | None
    """Agreement of an oracle that knows the real events as far as frames can show them, fine."""
    ks: float
    """Kolmogorov-Smirnov distance of the intervals between successive events of a pixel."""
    ks_floor: float | None
    two_sample: two_sample.Told | None
    events: tuple[int, int]
    """Numbers of real and of simulated events."""
    on_share: tuple[float, float]
    variance_over_mean: tuple[float, float]
    """Variance over mean of the pixels' numbers of events; 1 for events at random of equal pixels."""
    levels: tuple[LevelRates, ...] | None
    """Of the real events and of the simulated."""
    spectrum: tuple[np.ndarray, np.ndarray, np.ndarray]
    """Frequencies in Hz, power densities of the real and of the simulated rate."""
    start_us: int
    end_us: int
    notes: tuple[str, ...]

    def as_json(self) -> dict[str, Any]:
        """Everything, for a machine; null where a figure is not defined."""
        hz, real, simulated = self.spectrum
        said = {
            "total": self.fine.total,
            "l1_per_event": self.fine.l1_per_event,
            "correlation": self.fine.correlation,
            "l1_per_event_8x8": self.coarse.l1_per_event,
            "correlation_8x8": self.coarse.correlation,
            "floor": self.floor and self.floor.l1_per_event,
            "floor_correlation": self.floor and self.floor.correlation,
            "floor_8x8": self.floor_coarse and self.floor_coarse.l1_per_event,
            "oracle": self.oracle and self.oracle.l1_per_event,
            "ks": self.ks,
            "ks_floor": self.ks_floor,
            "two_sample_accuracy": self.two_sample and self.two_sample.accuracy,
            "two_sample_error": self.two_sample and self.two_sample.error,
            "two_sample_pairs": self.two_sample and self.two_sample.pairs,
            "events": _sides(self.events),
            "on_share": _sides(self.on_share),
            "variance_over_mean": _sides(self.variance_over_mean),
            "rate_by_level": None if self.levels is None else _level_rows(self.levels),
            "spectrum_db": timing.spectrum_distance_db(real, simulated),
            "spectrum": {"hz": hz, "real": real, "simulated": simulated},
            "start_s": self.start_us / 1e6,
            "end_s": self.end_us / 1e6,
            "notes": self.notes,
        }
        return plain(said)


def compare(pair: Pair, *, seed: int = 0, classifier: bool = True) -> Realism:
    """The figures of a pair. Without the extra learn, or with classifier=False, there is no two-sample test.

    Raises DataError for a stretch without real events, or shorter than a coarse cell.
    """
    if pair.end_us - pair.start_us < COARSE[1]:
        length = (pair.end_us - pair.start_us) / 1e6
        raise DataError(f"start-s, end-s: {length:.3f} s to score; expected {COARSE[1] / 1e6:g} s or more")
    pair, notes = pair.within(), []
    streams, span, other = (pair.real, pair.simulated), (pair.start_us, pair.end_us), pair.other_draw
    fine, coarse = (Cells(pair.size, *span, *kind) for kind in (FINE, COARSE))
    if not len(pair.real):
        raise DataError("start-s, end-s: the recording has no event between them; expected some to score")
    tested = None
    if classifier and find_spec("torch") is None:
        notes.append("no two-sample test: it needs the extra learn: pip install 'evslip[learn]'")
    elif classifier:
        tested = two_sample.classifier_test(*streams, pair.size, span, seed)
    if other is None:
        notes.append("no floor: two files do not say how two draws of the sensor differ; --camera does")
    oracle = levels = None
    if pair.footage is None:
        notes.append("no rates by light: the recording has no frames")
    else:
        oracle = agreement(frame_counts(pair.real, pair.footage.t_us, fine), counts(pair.real, fine))
        levels = tuple(rates_by_level(events, pair.footage, *span) for events in streams)
    real, simulated = (intervals_us(events, pair.size[0])[0] for events in streams)
    return Realism(
        fine=_agreement(pair.simulated, pair.real, fine),
        coarse=_agreement(pair.simulated, pair.real, coarse),
        floor=None if other is None else _agreement(other, pair.simulated, fine),
        floor_coarse=None if other is None else _agreement(other, pair.simulated, coarse),
        oracle=oracle,
        ks=timing.ks_distance(real, simulated),
        ks_floor=None if other is None else timing.ks_distance(simulated, intervals_us(other, pair.size[0])[0]),
        two_sample=tested,
        events=(len(pair.real), len(pair.simulated)),
        on_share=(_mean(pair.real.p), _mean(pair.simulated.p)),
        variance_over_mean=(_dispersion(pair.real, pair.size), _dispersion(pair.simulated, pair.size)),
        levels=levels,
        spectrum=_spectra(pair),
        start_us=pair.start_us,
        end_us=pair.end_us,
        notes=tuple(notes),
    )


def _agreement(simulated: Events, real: Events, cells: Cells) -> Agreement:
    return agreement(counts(simulated, cells), counts(real, cells))


def _spectra(pair: Pair) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    hz, real = timing.rate_spectrum(pair.real, pair.start_us, pair.end_us)
    return hz, real, timing.rate_spectrum(pair.simulated, pair.start_us, pair.end_us)[1]


def _mean(polarities: np.ndarray) -> float:
    return float(polarities.mean()) if len(polarities) else math.nan


def _dispersion(events: Events, size: tuple[int, int]) -> float:
    numbers = np.bincount(events.y.astype(np.int64) * size[0] + events.x, minlength=size[0] * size[1])
    return float(numbers.var() / numbers.mean()) if numbers.any() else math.nan


def _sides(pair: tuple[Any, Any]) -> dict[str, Any]:
    return {"real": pair[0], "simulated": pair[1]}


def _level_rows(levels: tuple[LevelRates, ...]) -> list[dict[str, Any]]:
    real, simulated = levels
    return [
        {
            "level": name,
            "pixel_s": real.pixel_s[i],
            "rate_hz": _sides((real.rate_hz[i], simulated.rate_hz[i])),
            "on_share": _sides((real.on_share[i], simulated.on_share[i])),
        }
        for i, name in enumerate(NAMES)
    ]
