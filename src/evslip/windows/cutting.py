"""Cutting records into labelled windows: slices of the stream that hold, or slip, as the ground truth says."""

import math
import zlib
from collections import defaultdict
from collections.abc import Iterable, Iterator
from itertools import compress
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from evslip.data.record import Record
from evslip.data.samples import Samples
from evslip.events.frame import BODIES, NO_BODY, OBJECT
from evslip.events.stream import Events
from evslip.physics.truth import Truth
from evslip.utils.errors import ConfigError, DataError
from evslip.utils.progress import over
from evslip.windows.alignment import laid_on
from evslip.windows.distinct import Distinct
from evslip.windows.label import Label
from evslip.windows.mixture import Mixture
from evslip.windows.object_events import ObjectEvents, cell_of, extent_of, view_of
from evslip.windows.window_events import WindowEvents, pack, pixel_dtype
from evslip.windows.window_set import MAP_PX, Windows, WindowSettings, balanced_choice

SPEED_S = 0.02
"""Time before a window's end over which its speeds are means. At 5 deg/s the object turns by the limit of a hold in it,
0.1 deg, about the least that pixels answer to; a longer time would lag more behind a slip that gathers speed."""
RECENT_S = 0.2
"""A pixel in the dark goes on firing for about this long after a slip has ended."""


def windows_of(
    records: Iterable[Record], settings: WindowSettings | None = None, whole_sensor: bool = False
) -> Windows:
    """Cut records into labelled windows that lie wholly in the held time, or in one of a person's intervals, which go
    before. A window without events is one, too, but none begins after the recording's end.

    On records of another sensor than that of the settings the crop lies as far from the centre; with `whole_sensor` it
    is the sensor. Raises DataError if there is not one window, and for records of different sensors, a crop beyond
    them, and a record that comes twice.
    """
    settings = settings or WindowSettings()
    columns: dict[str, list[np.ndarray]] = defaultdict(list)
    dropped, first, seen, found = 0, "", Distinct(), 0
    kept = _kept(records, settings)
    for record in over("records", records):
        if not first:
            settings, first = laid_on(settings, record.size), record.name
            settings = settings.of_whole_sensor() if whole_sensor else settings
            if not settings.sees_the_sensor:
                raise ConfigError(settings.beyond())
        elif record.size != settings.sensor:
            sizes = [f"{width}x{height}" for width, height in (record.size, settings.sensor)]
            raise DataError(
                f"{record.name}: from a sensor of {sizes[0]} pixels, and {first} from one of {sizes[1]}; expected "
                "windows of one sensor"
            )
        cut = labelled(record, settings)
        if cut:
            seen.add(record)
        certain = [(movement, label) for movement, label in cut if label != Label.UNCERTAIN]
        chosen = certain if kept is None else list(compress(certain, kept[found:]))
        dropped, found = dropped + len(cut) - len(certain), found + len(certain)
        if chosen:
            _append(columns, record, settings, chosen)
    if not columns:
        raise DataError(
            f"no window of {settings.length_s:g} s in which an object is held and holds or slips; expected more "
            "records, or a smaller length_s"
        )
    sizes = np.array([len(part) for part in columns["packed"]])
    arrays = {name: _joined(columns.pop(name)) for name in list(columns)}
    last = np.cumsum(sizes)
    known = (arrays.pop(name) for name in ("flags", "extent", "view"))
    objects = ObjectEvents.of(next(known), arrays["events"], *known)
    windows = Windows(settings, first=last - sizes, last=last, dropped=dropped, object_events=objects, **arrays)
    return windows.balanced(settings.seed, settings.ratio) if settings.balance and kept is None else windows


def _joined(parts: list[np.ndarray]) -> np.ndarray:
    """All parts one after the other; each is forgotten as soon as it is copied, for together they may fill the memory
    by half."""
    out, first = np.empty((sum(map(len, parts)), *parts[0].shape[1:]), np.result_type(*parts)), 0
    parts.reverse()
    while parts:
        part = parts.pop()
        out[first : first + len(part)] = part
        first += len(part)
    return out


def _kept(records: Iterable[Record], settings: WindowSettings) -> np.ndarray | None:
    """Which windows that hold or slip stay in the balance, bool (n,), where that is known before any events are read:
    most of them are thinned out, and would be cut, and kept in memory, for nothing. None where it is not."""
    if not settings.balance or not isinstance(records, Samples | Mixture):
        return None
    found: list[Label] = []
    for record in over("labels", records.without_events()):
        if record.intervals:  # these may end with the last event
            return None
        found += [label for _, label in labelled(record, settings) if label != Label.UNCERTAIN]
    kept = np.zeros(len(found), bool)
    kept[balanced_choice(np.array(found), settings.seed, settings.ratio)] = True
    return kept


def entering(record: Record, settings: WindowSettings) -> "list[tuple[Movement, Label]]":
    """The windows that end in the held time of a record but begin before it, each with what the object does from when
    on it is held; or those that end in a person's interval but begin before it, which are uncertain. A detector on a
    robot answers for them, too."""
    if record.intervals:
        return [(movement, Label.UNCERTAIN) for movement in _entering_intervals(record, settings)]
    moved = [] if record.truth is None else movements(record.truth, settings, entering=True)
    return [(movement, label_of(movement, settings)) for movement in moved]


def _entering_intervals(record: Record, settings: WindowSettings) -> "Iterator[Movement]":
    length_us, hop_us = (round(seconds * 1e6) for seconds in (settings.length_s, settings.hop_s))
    first_us = int(record.events.t_us[0]) if record.events.count else record.last_us
    for interval in record.intervals:
        hops_before = (length_us - 1) // hop_us
        for start_us in range(interval.start_us - hops_before * hop_us, interval.start_us, hop_us):
            if first_us <= start_us <= interval.end_us - length_us:
                yield _unmeasured(start_us)


def labelled(record: Record, settings: WindowSettings) -> "list[tuple[Movement, Label]]":
    """Windows of a record with their labels: by a person's intervals if there are any, else by the ground truth; none
    without either."""
    if record.intervals:
        last_us = record.last_us
        length_us, hop_us = (round(seconds * 1e6) for seconds in (settings.length_s, settings.hop_s))
        return [
            (_unmeasured(start_us), Label[interval.label.upper()])
            for interval in record.intervals
            for start_us in range(interval.start_us, min(interval.end_us - length_us, last_us) + 1, hop_us)
        ]
    moved = [] if record.truth is None else movements(record.truth, settings)
    return [(movement, label_of(movement, settings)) for movement in moved]


class Movement(NamedTuple):
    """Movement of the object in the hand during one window; nan where only a person has labelled it."""

    start_us: int
    rotation_deg: float
    """The largest in the part that counts for the label (`WindowSettings.labelled_s`), since its start."""
    translation_mm: float
    """The largest, likewise."""
    theta_rise_deg: float
    """How much greater the paper's theta is at the window's end than at that part's start; 0 if it is not."""
    rotation_speed_deg_s: float
    """Angle between the object's orientations SPEED_S before the window's end and at it, over that time."""
    slide_speed_mm_s: float
    """Way of the gripped point in the same time, over that time."""


def _unmeasured(start_us: int) -> Movement:
    return Movement(start_us, *[math.nan] * 5)


def movements(truth: Truth, settings: WindowSettings, entering: bool = False) -> list[Movement]:
    """The movement in every window of the held time; or, `entering`, in those that end in it but begin before, from
    when on the object is held."""
    held = np.flatnonzero(truth.held)
    if len(held) < 2:
        return []
    step_us = int(truth.t_us[1] - truth.t_us[0])
    spans_s = settings.length_s, settings.hop_s, settings.labelled_s, SPEED_S
    length, hop, counted, newest = (max(1, round(seconds * 1e6 / step_us)) for seconds in spans_s)
    begin, end = int(held[0]), int(held[-1]) + 1 - length
    starts = range(begin, end, hop)
    if entering:  # as many hops before as leave a part of the window in the held time, and the whole in the record
        starts = range(begin - min(length - 1, begin) // hop * hop, min(begin, end), hop)
    orientation = Rotation.from_quat(truth.rotation, scalar_first=True)
    found = []
    for first in starts:
        last = first + length
        since = max(last - counted, begin)
        turned, slid = (float(values.max()) for values in _moved(truth, orientation, since, last))
        rise = max(0.0, float(truth.theta_deg[last]) - float(truth.theta_deg[since]))
        before = max(since, last - newest)
        seconds = (last - before) * step_us / 1e6
        speeds = (float(values[-1]) / seconds for values in _moved(truth, orientation, before, last))
        found.append(Movement(int(truth.t_us[first]), turned, slid, rise, *speeds))
    return found


def _moved(truth: Truth, orientation: Rotation, since: int, last: int) -> tuple[np.ndarray, np.ndarray]:
    """How far the object has turned, in degrees, and slid, in mm, since a sample, at each up to the last."""
    part = slice(since, last + 1)
    turned = np.degrees((orientation[since].inv() * orientation[part]).magnitude())
    return turned, 1e3 * np.linalg.norm(truth.position_m[part] - truth.position_m[since], axis=1)


def label_of(movement: Movement, settings: WindowSettings) -> Label:
    """Label of a window by what the object does in it."""
    angle = movement.theta_rise_deg if settings.labels == "paper" else movement.rotation_deg
    slides = settings.labels == "motion"
    if angle >= settings.slip_deg or (slides and movement.translation_mm >= settings.slip_mm):
        return Label.SLIP
    lies = angle < settings.hold_deg and not (slides and movement.translation_mm >= settings.hold_mm)
    return Label.HOLD if lies else Label.UNCERTAIN


def crop(events: Events, settings: WindowSettings) -> Events:
    """The events in the crop, columns and rows (see `pixel_dtype`) counted from its corner."""
    x, y = events.x.astype(np.int32) - settings.left, events.y.astype(np.int32) - settings.top
    inside = np.flatnonzero((x >= 0) & (x < settings.width) & (y >= 0) & (y < settings.height))
    dtype = pixel_dtype(settings.width, settings.height)
    return events.select(inside).replace(x=x[inside].astype(dtype), y=y[inside].astype(dtype))


def _append(
    columns: dict[str, list[np.ndarray]], record: Record, settings: WindowSettings, chosen: list[tuple[Movement, Label]]
) -> None:
    whole = crop(record.events, settings)
    extent, view = extent_of(whole, settings), view_of(record)
    for movement, label in chosen:
        start_us = movement.start_us
        inside = whole.between(start_us, start_us + round(settings.length_s * 1e6))
        bodies = np.full(inside.count, NO_BODY, np.uint8) if inside.body is None else inside.body
        packed = pack(WindowEvents.of(inside, start_us))
        row = {
            "events": inside.count,
            "checksum": np.uint32(zlib.crc32(packed.data)),
            "label": np.uint8(label),
            "name": record.name,
            "start_us": start_us,
            "rotation_deg": np.float32(movement.rotation_deg),
            "translation_mm": np.float32(movement.translation_mm),
            "rotation_speed_deg_s": np.float32(movement.rotation_speed_deg_s),
            "slide_speed_mm_s": np.float32(movement.slide_speed_mm_s),
            "recent": moved_before(record, start_us, settings),
            "by_body": np.bincount(bodies[bodies < len(BODIES)], minlength=len(BODIES)),
            "object_map": _object_map(inside, settings),
            "extent": extent,
            "view": view,
        }
        columns["packed"].append(packed)
        columns["flags"].append(np.packbits(bodies == OBJECT))
        for name, value in row.items():
            columns[name].append(np.array([value]))


def _object_map(inside: Events, settings: WindowSettings) -> np.ndarray:
    shape = settings.cells(MAP_PX)
    if inside.body is None:
        return np.zeros(shape, np.uint16)
    cell = cell_of(inside, MAP_PX, settings.width)[inside.body == OBJECT]
    number = np.bincount(cell, minlength=math.prod(shape)).reshape(shape)
    return np.minimum(number, np.iinfo(np.uint16).max).astype(np.uint16)


def moved_before(record: Record, start_us: int, settings: WindowSettings) -> bool:
    """Whether the object moved, by the limits of a hold, in the 0.2 s before a time; or, of a labelled recording, was
    said to slip."""
    truth, since_us = record.truth, start_us - RECENT_S * 1e6
    if record.intervals:
        slips = [interval for interval in record.intervals if interval.label == "slip"]
        return any(slip.start_us < start_us and slip.end_us > since_us for slip in slips)
    if truth is None:
        return False
    first, last = np.searchsorted(truth.t_us, (since_us, start_us))
    before = Rotation.from_quat(truth.rotation[first : last + 1], scalar_first=True)
    turned = np.degrees((before[-1].inv() * before).magnitude()).max()
    slid = 1e3 * np.linalg.norm(truth.position_m[first : last + 1] - truth.position_m[last], axis=1).max()
    return bool(turned >= settings.hold_deg or slid >= settings.hold_mm)
