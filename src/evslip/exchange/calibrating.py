"""A preset of the event camera from recordings of a real one."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from evslip.codecs.clips import flow
from evslip.codecs.clips.grey import to_grey
from evslip.codecs.clips.pixels import check_sensor
from evslip.data.footage import Footage
from evslip.events import preset_file
from evslip.events.calibration.calibration import Calibration, calibrate, calibrate_blind
from evslip.events.calibration.exposures import steadied, white_of
from evslip.events.calibration.scene import Scene
from evslip.events.quality.pixel_activity import PixelActivity
from evslip.events.stream import Events
from evslip.exchange.importing.event_files import read_event_file
from evslip.exchange.importing.settings import Importing
from evslip.utils.errors import ConfigError, DataError

LEAST_FRAMES = 3
MOST_BYTES = 300 << 20
"""Size of the frames at close times that are kept; of a longer recording the part with the most events is taken."""
UPSAMPLE = 10
"""Times between one exposure and the next."""


class Span(NamedTuple):
    """Part of a recording, seconds after its first event."""

    start_s: float = 0.0
    end_s: float = float("inf")

    def ends_us(self, events: Events) -> tuple[int, int]:
        """Begin and end, exclusive, on the clock of some events, of which there are any."""
        first_us, last_us = int(events.t_us[0]), int(events.t_us[-1])
        start_us = first_us + round(min(max(self.start_s, 0.0), 1e9) * 1e6)
        return start_us, min(first_us + round(min(self.end_s, 1e9) * 1e6), last_us + 1)


WHOLE = Span()


def calibrate_recordings(
    recordings: Sequence[str | Path],
    out: str | Path,
    span: Span = WHOLE,
    upsample: int = UPSAMPLE,
    seed: int = 0,
    each_pixel: bool = False,
) -> Calibration:
    """Fit the sensor of some recordings and write a preset, TOML, see `evslip.events.preset_file`.

    span: the part of each that is looked at; each_pixel: thresholds as maps too, in a file
    beside. Raises ConfigError, DataError, MissingExtraError, StorageError."""
    out = Path(out)
    if out.suffix.lower() != preset_file.SUFFIX:
        raise ConfigError(f"{out}: a preset is a .toml file, or .npz for the noise alone; its name must end so")
    flow.check_upsample(upsample)
    for number, path in enumerate(recordings):
        if Path(path).resolve() in {Path(other).resolve() for other in recordings[:number]}:
            raise ConfigError(f"recordings: {path} is named more than once; expected different ones")
    seen = [_seen(Path(path), span) for path in recordings]
    with_frames = [one for one in seen if one.footage is not None]
    if with_frames:
        found = calibrate([_scene(one, upsample) for one in with_frames], seed, each_pixel)
    else:
        found = calibrate_blind([(one.events, one.size) for one in seen])
    left = [one.path.name for one in seen if with_frames and one.footage is None]
    if left:
        found.unknown.append(f"what {', '.join(left)} tell: fewer than {LEAST_FRAMES} frames in the part looked at")
    found.unknown.extend(filter(None, map(_hot, with_frames or seen)))
    names = ", ".join(one.path.name for one in with_frames or seen)
    head = f"# Fitted by evslip calibrate to {names}; luminance is the frames' codes over 255.\n"
    fit = {fact.name: fact.entries() for fact in found.facts}
    preset_file.write(out, found.model, fit, head)
    return found


def part_of(events: Events, span: Span, path: Path) -> Events:
    """Events of a span of a file's. Raises DataError if there are none."""
    part = events.between(*span.ends_us(events)) if len(events) else events
    if not len(part):
        raise DataError(f"{path}: no events between {span.start_s:g} and {span.end_s:g} s after the first one")
    return part


class _Seen(NamedTuple):
    path: Path
    events: Events
    size: tuple[int, int]
    footage: Footage | None


def _seen(path: Path, span: Span) -> _Seen:
    """The asked part of a recording's events, and its frames if it has any."""
    record = read_event_file(path, Importing(), from_zero=False)
    events, footage, size = record.events, record.footage, record.size
    check_sensor(size, path)
    if not len(events):
        raise DataError(f"{path}: holds no events to calibrate a camera with")
    start_us, end_us = span.ends_us(events)
    part = part_of(events, span, path)
    if part.t_us[0] == part.t_us[-1]:
        raise DataError(f"{path}: all of its {len(part)} events are at one time; expected some that span a time")
    if footage is not None:
        chosen = (footage.t_us >= start_us) & (footage.t_us <= end_us)
        footage = Footage(footage.t_us[chosen], footage.images[chosen]) if chosen.sum() >= LEAST_FRAMES else None
    return _Seen(path, part, size, footage)


def _hot(seen: _Seen) -> str:
    """What hot pixels keep a fit from telling, if there are any."""
    activity = PixelActivity(seen.size)
    activity.add(seen.events)
    faults = activity.faults()
    if faults is None or not len(faults.hot):
        return ""
    share, count = faults.hot_events / len(seen.events), len(faults.hot)
    return (
        f"leak apart from hot pixels: {count} of {seen.path.name} have {share:.1%} of the events; "
        "leave them out first (evslip info --hot, evslip convert --without)"
    )


def _scene(seen: _Seen, upsample: int) -> Scene:
    footage = seen.footage
    assert footage is not None  # asked before
    height, width = footage.images.shape[1:3]
    most = max(LEAST_FRAMES, MOST_BYTES // (4 * height * width * upsample))
    chosen = _busiest(footage.t_us, seen.events.t_us, most)
    codes = np.stack([to_grey(image, "uint8") for image in footage.images[chosen]])
    return scene_from(seen.events, footage.t_us[chosen].astype(np.float64), codes, upsample)


def scene_from(events: Events, times_us: np.ndarray, codes: np.ndarray, upsample: int = UPSAMPLE) -> Scene:
    """Events, and the frames at these times, grey codes of shape (k, height, width), brought along image motion. Codes
    are taken as proportional to light. Raises ConfigError, MissingExtraError."""
    exposures, white = codes.astype(np.float32) / 255, white_of(codes)
    steady = steadied(exposures, white) * 255
    timed = ((t_us, image, None) for t_us, image in zip(times_us.tolist(), steady, strict=True))
    close = list(flow.smoothed(timed, upsample, "uint8"))
    return Scene(
        events.between(int(times_us[0]), int(times_us[-1])),
        (codes.shape[2], codes.shape[1]),
        np.array([t_us for t_us, _, _ in close]),
        np.stack([np.asarray(light, np.float32) / 255 for _, light, _ in close]),
        times_us,
        exposures,
        white,
    )


def _busiest(frames_us: np.ndarray, events_us: np.ndarray, most: int) -> slice:
    """At most so many successive frames: those with the most events between them."""
    if len(frames_us) <= most:
        return slice(None)
    before = np.searchsorted(events_us, frames_us)
    first = int(np.argmax(before[most - 1 :] - before[: len(before) - most + 1]))
    return slice(first, first + most)
