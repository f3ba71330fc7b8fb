"""Predictions of a detector for every moment in which an object is held, beside the truth and the conditions."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields, replace

import numpy as np

from evslip.data.record import Record
from evslip.events.frame import OBJECT
from evslip.learn.inference import BATCH, COLUMNS, Answers, answers, predict
from evslip.learn.networks.network import Network
from evslip.utils.errors import DataError
from evslip.windows.alignment import require_sensor
from evslip.windows.conditions import Conditions, conditions
from evslip.windows.cutting import crop, entering, labelled, moved_before
from evslip.windows.settings import Align
from evslip.windows.window_set import WindowEvents, Windows, WindowSettings

UNKNOWN = -1
"""Count of events on the object where nobody knows the bodies."""


@dataclass(frozen=True)
class Track:
    """One trajectory among the predictions."""

    name: str
    rows: slice
    """Its predictions, in order of time."""
    onset_us: int | None
    """When the first slip begins."""
    end_us: int | None
    """When it ends."""


@dataclass(frozen=True)
class Predictions:
    """Windows at every hop, n of them. Arrays of shape (n,) unless said otherwise."""

    p_slip: np.ndarray
    label: np.ndarray
    """A Label."""
    counted: np.ndarray
    """Which windows are scored one by one: those wholly in the held time that do not overlap; bool."""
    track: np.ndarray
    """Position in `tracks`."""
    start_us: np.ndarray
    rotation_deg: np.ndarray
    """Largest rotation in the hand since the start of the window's part that counts for the label."""
    translation_mm: np.ndarray
    """Largest slide in the hand, likewise."""
    speeds: np.ndarray
    """Speeds at which the object turns, in deg/s, and slides, in mm/s, in the hand, means of the window's last 20 ms:
    (n, 2); nan where nobody knows."""
    estimates: np.ndarray
    """Median and scale of either speed as a SpeedEstimate has them, of shape (n, 4); nan without an estimate."""
    recent: np.ndarray
    """Whether the object moved in the 0.2 s before the window; bool."""
    events: np.ndarray
    """Events in the crop."""
    object_events: np.ndarray
    """Events on the object, in the crop; UNKNOWN in real recordings."""
    conditions: Conditions
    tracks: tuple[Track, ...]
    length_us: int
    """Length of a window."""
    hop_us: int
    """From one window's start to the next one's; 0: windows that were cut and thinned out before, no stream."""

    @property
    def end_us(self) -> np.ndarray:
        """When each prediction is given: at the end of its window."""
        return self.start_us + self.length_us

    @property
    def flagged(self) -> np.ndarray:
        """Windows in which even a good detector may see movement that is none: just after a slip, or while shadows and
        shading change on the object; bool of shape (n,)."""
        return self.recent | self.conditions.shading

    @property
    def names(self) -> np.ndarray:
        """Name of each window's trajectory."""
        return np.array([track.name for track in self.tracks])[self.track]

    def take(self, which: np.ndarray) -> "Predictions":
        """Predictions of a mask; the tracks' rows are those of the whole."""
        arrays = {f.name: getattr(self, f.name)[which] for f in fields(self) if f.name in _ARRAYS}
        return replace(self, **arrays, conditions=self.conditions.take(which))


_ARRAYS = tuple(field.name for field in fields(Predictions) if field.type is np.ndarray)


def on_windows(network: Network, windows: Windows, progress: Callable[[int], None] | None = None) -> Predictions:
    """Predictions on windows cut before, of the network's size. `progress` is called with numbers of windows."""
    names, track = np.unique(windows.name, return_inverse=True)
    bodies = windows.by_body.sum(1) > 0
    settings = windows.settings
    n = len(windows)
    return Predictions(
        **_answered(answers(network, windows, progress)),
        label=windows.label,
        counted=np.ones(n, bool),
        track=track,
        start_us=windows.start_us,
        rotation_deg=windows.rotation_deg,
        translation_mm=windows.translation_mm,
        speeds=np.stack([windows.rotation_speed_deg_s, windows.slide_speed_mm_s], 1),
        recent=windows.recent.astype(bool),
        events=windows.events,
        object_events=np.where(bodies, windows.by_body[:, OBJECT], 0) if bodies.any() else np.full(n, UNKNOWN),
        conditions=Conditions.unknown(n),
        tracks=tuple(Track(str(name), slice(0, 0), None, None) for name in names),
        length_us=round(settings.length_s * 1e6),
        hop_us=0,
    )


def on_records(
    network: Network, settings: WindowSettings, records: Iterable[Record], hop_s: float, align: Align | None = None
) -> Predictions:
    """Predictions at every hop of the held time of records, or of a person's intervals, from its first moment on, cut
    and labelled as the settings say; none is left out.

    Records without either say nothing and are passed over. Raises DataError if nothing is left, and for a record of
    another sensor unless `align` says how the crop lies on it.
    """
    parts: list[Predictions] = []
    for record in records:
        own = require_sensor(settings, record.size, align, record.name)
        part = _on_record(network, replace(own, hop_s=hop_s), record)
        if part is not None:
            parts.append(part)
    if not parts:
        raise DataError(f"no record with a truth or labels in which an object is held for {settings.length_s:g} s")
    return _joined(parts)


def _on_record(network: Network, settings: WindowSettings, record: Record) -> Predictions | None:
    inside_held = labelled(record, settings)
    if not inside_held:
        return None
    rows = [(*one, False) for one in entering(record, settings)] + [(*one, True) for one in inside_held]
    rows.sort(key=lambda row: row[0].start_us)  # a person's intervals are entered one after another
    moved, labels, is_inside = (list(column) for column in zip(*rows, strict=True))
    length_us = round(settings.length_s * 1e6)
    start_us = np.array([movement.start_us for movement in moved], np.int64)
    inside = crop(record.events, settings)
    bounds = np.searchsorted(inside.t_us, np.stack([start_us, start_us + length_us]))
    on_object = None if inside.body is None else np.concatenate([[0], np.cumsum(inside.body == OBJECT)])
    columns = [np.empty((0, COLUMNS), np.float32)]
    for first in range(0, len(moved), BATCH):
        chosen = range(first, min(first + BATCH, len(moved)))
        windows = [WindowEvents.of(inside.select(slice(*bounds[:, i])), int(start_us[i])) for i in chosen]
        columns.append(predict(network, [network.prepare(window) for window in windows]))
    return Predictions(
        **_answered(Answers.of(np.concatenate(columns))),
        label=np.array(labels, np.uint8),
        counted=_apart(start_us, np.array(is_inside), length_us),
        track=np.zeros(len(moved), np.int64),
        start_us=start_us,
        rotation_deg=np.array([movement.rotation_deg for movement in moved]),
        translation_mm=np.array([movement.translation_mm for movement in moved]),
        speeds=np.array([(movement.rotation_speed_deg_s, movement.slide_speed_mm_s) for movement in moved]),
        recent=np.array([moved_before(record, int(start), settings) for start in start_us]),
        events=bounds[1] - bounds[0],
        object_events=np.full(len(moved), UNKNOWN) if on_object is None else np.diff(on_object[bounds], axis=0)[0],
        conditions=conditions(record, start_us, length_us),
        tracks=(Track(record.name, slice(0, len(moved)), record.onset_us, _end_of_slip(record)),),
        length_us=length_us,
        hop_us=round(settings.hop_s * 1e6),
    )


def _answered(found: Answers) -> dict[str, np.ndarray]:
    estimates = np.stack([*found.rotation_speed, *found.slide_speed], 1)
    return {"p_slip": found.p_slip.astype(float), "estimates": estimates}


def _apart(start_us: np.ndarray, eligible: np.ndarray, length_us: int) -> np.ndarray:
    """Which of the eligible windows to take so that none overlaps the one taken before; bool of shape (n,)."""
    taken, free_us = np.zeros(len(start_us), bool), np.iinfo(np.int64).min
    for i in np.flatnonzero(eligible):
        if start_us[i] >= free_us:
            taken[i], free_us = True, start_us[i] + length_us
    return taken


def _end_of_slip(record: Record) -> int | None:
    """End of the first slip; of records without episodes, the end of the held time."""
    if record.intervals:
        return next((interval.end_us for interval in record.intervals if interval.label == "slip"), None)
    truth = record.truth
    if truth is None or truth.onset_us is None:
        return None
    if truth.episodes:
        return truth.episodes[0].end_us
    held = np.flatnonzero(truth.held)
    return int(truth.t_us[held[-1]]) if len(held) else None


def _joined(parts: list[Predictions]) -> Predictions:
    arrays = {name: np.concatenate([getattr(part, name) for part in parts]) for name in _ARRAYS}
    arrays["track"] = np.repeat(np.arange(len(parts)), [len(part.p_slip) for part in parts])
    ends = np.cumsum([len(part.p_slip) for part in parts]).tolist()
    tracks = tuple(
        replace(part.tracks[0], rows=slice(start, end))
        for part, start, end in zip(parts, [0, *ends[:-1]], ends, strict=True)
    )
    return replace(
        parts[0], **arrays, conditions=Conditions.concatenate([part.conditions for part in parts]), tracks=tracks
    )
