"""One opened record, and what the pages draw of it."""

import threading
from typing import Any

import numpy as np

from evslip.data.record import Record
from evslip.events.stream import Events
from evslip.physics.motion.phases import phase_times
from evslip.view.pictures.figures import thinned
from evslip.view.pictures.frame_source import FrameSource, span_of

RATE_BINS = 600
"""Steps of the curve of event rates."""
CURVE_POINTS = 1500
"""Most points of a curve."""
EVENT = np.dtype([("t_us", "<u4"), ("x", "<u2"), ("y", "<u2"), ("flags", "u1")])
"""An event on its way to the page: time since the beginning of the asked span; flags: bit 0 polarity, bits 1-3 body
(7 is unknown), bits 4-5 cause."""
UNKNOWN_BODY = 7
LONGEST_US = 60_000_000
"""Longest span of events that is sent at once."""


class Sample:
    """A record with its pictures; safe to use from several threads."""

    def __init__(self, record: Record, label: str = ""):
        """`label`: slip or hold, as the data set has it; default: as the record has it."""
        self.record, self._label = record, label or record.label
        self._sight, self._lock = FrameSource(record), threading.Lock()
        self.span_us = span_of(record)
        """The time there is something to see."""

    def pixels(self, t_us: int) -> np.ndarray:
        """Picture of the camera at a time, as a canvas holds it: RGBA, uint8 of shape (height, width, 4). Raises
        ConfigError, DataError."""
        first, last = self.span_us
        with self._lock:
            picture = self._sight.at(min(max(t_us, first), last))
        return np.dstack([picture, np.full(picture.shape[:2], 255, np.uint8)])

    def packed(self, start_us: int, end_us: int, most: int) -> tuple[np.ndarray, int]:
        """Events of a span, thinned evenly to `most`, as EVENT, and how many there were."""
        end_us = min(end_us, start_us + LONGEST_US)
        events = self.record.events.between(start_us, end_us)
        return pack(thinned(events, most), start_us), events.count

    def about(self) -> dict[str, Any]:
        """Facts that the page needs before it plays; times in microseconds."""
        record = self.record
        width, height = record.size
        times, truth = record.events.t_us, record.truth
        slips = [[i.start_us, i.end_us, i.label] for i in record.intervals if i.label == "slip"]
        held = [[i.start_us, i.end_us] for i in record.intervals if i.label == "hold"]
        onset_us = None
        if truth is not None and not record.intervals:
            slips = [[episode.start_us, episode.end_us, episode.kind] for episode in truth.episodes]
            held_us = truth.t_us[truth.held]
            held = [[int(held_us[0]), int(held_us[-1])]] if len(held_us) else []
            onset_us = truth.onset_us
        phases = {} if truth is None or record.params is None else phase_times(record.params)
        return {
            "name": record.name, "kind": record.kind, "width": width, "height": height, "events": record.events.count,
            "start_us": self.span_us[0], "end_us": self.span_us[1],
            "origin_us": 0 if record.truth is not None else self.span_us[0],
            "first_event_us": int(times[0]) if len(times) else self.span_us[0], "frames": self._sight.is_there,
            "bodies": record.events.body is not None, "facts": self._facts(),
            "phases": [[name, *span] for name, span in phases.items()], "slips": slips, "held": held,
            "curves": [*self._truth_curves(), self._rates()], "onset_us": onset_us,
        }  # fmt: skip

    def _facts(self) -> list[tuple[str, str]]:
        from evslip.config.units import tell
        from evslip.view.report.facts import doubt_of, facts_of

        record = self.record
        facts = [
            ("events", f"{record.events.count:,}"),
            ("sensor", f"{record.size[0]} x {record.size[1]}"),
            *record.notes.items(),
        ]
        if record.params is None or record.truth is None:
            return facts
        params, known = record.params, facts_of(record)
        doubt = doubt_of(self._label, known)
        return [
            ("label", self._label),
            *([("doubt", doubt)] if doubt else []),
            ("mass", tell("_kg", known["mass_kg"])),
            ("onset mass", tell("_kg", known["onset_mass_kg"])),
            ("object", f"{known['shape']}, {known['texture']}"),
            ("grip", f"{params.grip.force_n:.3g} N, friction {params.grip.friction:.3g}"),
            ("motion", known["motion"]),
            ("onset", "never" if known["onset_s"] is None else f"{known['onset_s']:.3f} s"),
            ("turned", f"{known['turned_deg']:.3g} deg while held"),
            ("slid", f"{known['slid_mm']:.3g} mm while held"),
            *facts,
        ]

    def _rates(self) -> dict[str, Any]:
        first, last = self.span_us
        edges = np.linspace(first, last, RATE_BINS + 1)
        seconds = max(1e-6, (last - first) / RATE_BINS / 1e6)
        events = self.record.events
        on, _ = np.histogram(events.t_us[events.p], edges)
        off, _ = np.histogram(events.t_us[~events.p], edges)
        return curve("events", "1000/s", edges[:-1], {"ON": on / seconds / 1e3, "OFF": off / seconds / 1e3})

    def _truth_curves(self) -> list[dict[str, Any]]:
        truth = self.record.truth
        if truth is None:
            return []
        first, last = np.searchsorted(truth.t_us, self.span_us)
        keep = slice(int(first), int(last) + 1, max(1, (int(last) - int(first)) // CURVE_POINTS))
        t_us = truth.t_us[keep]
        curves = [
            curve("turned", "deg", t_us, {"theta": truth.theta_deg[keep]}),
            curve("slid", "mm", t_us, {"slide": truth.slide_mm[keep]}),
        ]
        both = (("pad force", "N", truth.pad_force_n), ("friction", "of limit", truth.pad_utilisation))
        pads = [(name, unit, values) for name, unit, values in both if values is not None]
        names = ("pad 1", "pad 2")
        return curves + [curve(name, unit, t_us, dict(zip(names, v[keep].T, strict=True))) for name, unit, v in pads]


def curve(name: str, unit: str, t_us: np.ndarray, lines: dict[str, np.ndarray]) -> dict[str, Any]:
    """A small plot under the picture: lines over the same times."""
    rounded = {key: [float(f"{value:.5g}") for value in values] for key, values in lines.items()}
    return {"name": name, "unit": unit, "t_us": np.asarray(t_us, np.int64).tolist(), "lines": rounded}


def pack(events: Events, start_us: int) -> np.ndarray:
    """Events as EVENT."""
    packed = np.empty(events.count, EVENT)
    packed["t_us"], packed["x"], packed["y"] = events.t_us - start_us, events.x, events.y
    body = np.uint8(UNKNOWN_BODY) if events.body is None else np.minimum(events.body, UNKNOWN_BODY)
    cause = np.uint8(0) if events.cause is None else events.cause & 3
    packed["flags"] = events.p.astype(np.uint8) | (body << 1) | (cause << 4)
    return packed
