"""The windows that a detector tells worst, with their events."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from evslip.data.record import Record
from evslip.events.overlay import overlay
from evslip.events.stream import Events
from evslip.utils import atomic
from evslip.view.pictures.frame_source import FrameSource
from evslip.view.pictures.images import encoded, jpeg_uri, white
from evslip.view.report import page
from evslip.windows.alignment import laid_on
from evslip.windows.label import Label
from evslip.windows.settings import Align
from evslip.windows.window_set import WindowSettings

if TYPE_CHECKING:
    from evslip.learn.evaluation.evaluation_data import EvaluationData
    from evslip.learn.scores.metrics import Metrics

FOLDER = "failures"
"""Beside evaluation.json: the pictures."""
MOST = 12
"""Windows of a model."""
PICTURES = 3
"""Pictures of a window, evenly over its time."""
SHOWN_US = 10_000
"""Each picture shows the events of this time before it."""

Show = Callable[["Failure"], str | None]
"""The picture of a window as a URI, if there is one."""


class Failure(NamedTuple):
    """A window and what is said of it."""

    name: str
    """Name of its trajectory."""
    start_us: int
    slips: bool
    """True label."""
    p_slip: float

    @property
    def file(self) -> str:
        """Name of its picture's file; the same for every model."""
        label = "slip" if self.slips else "hold"
        return f"{label}_{self.name.replace('/', '-')}_{self.start_us // 1000:06d}ms.jpg"


def worst(scores: "Metrics", most: int = MOST) -> list[Failure]:
    """The windows whose probability is farthest from the truth; none if the scores do not name their windows."""
    columns = scores.names, scores.starts_us, scores.labels, scores.probabilities
    if len({len(column) for column in columns}) != 1:
        return []
    rows = zip(*columns, strict=True)
    found = [Failure(str(name), int(start), label == Label.SLIP, float(p)) for name, start, label, p in rows]
    return sorted(found, key=lambda failure: -abs(failure.p_slip - failure.slips))[:most]


def failures(models: Sequence[tuple[str, float, Sequence[Failure]]], show: Show) -> str:
    """The gallery: name, threshold and worst windows of each model."""
    blocks = []
    for name, threshold, found in models:
        if found:
            head = f"<h3>{page.text(name)}</h3>" if len(models) > 1 else ""
            shown = "".join(_captioned(failure, threshold, show(failure)) for failure in found)
            blocks.append(f'{head}<div class="failures">{shown}</div>')
    note = (
        "Windows whose probability is farthest from the truth, the worst first: what the camera sees after a sixth, "
        f"half and five sixths of the window, with the events of the {SHOWN_US // 1000} ms before each."
    )
    return page.section("Worst windows", note, "".join(blocks)) if blocks else ""


def _captioned(failure: Failure, threshold: float, uri: str | None) -> str:
    said = failure.p_slip >= threshold
    verdict = "right" if said == failure.slips else "missed" if failure.slips else "false alarm"
    warn = "" if verdict == "right" else ' class="warn"'
    caption = (
        f"<b>{'slips' if failure.slips else 'holds'}</b>, probability {failure.p_slip:.3f}: "
        f"<span{warn}>{verdict}</span><br>{page.text(failure.name)}, from {failure.start_us / 1e6:.3f} s"
    )
    image = f'<img loading="lazy" src="{uri}" alt="{page.text(failure.file)}">' if uri else ""
    return f"<figure>{image}<figcaption>{caption}</figcaption></figure>"


def from_folder(folder: Path, otherwise: Show = lambda failure: None) -> Show:
    """Pictures that `save_pictures` has written, and others where it has not."""

    def show(failure: Failure) -> str | None:
        path = folder / failure.file
        return jpeg_uri(path.read_bytes()) if path.is_file() else otherwise(failure)

    return show


def from_records(find: Callable[[str], Record | None], settings: WindowSettings) -> Show:
    """Pictures drawn from the records that `find` gives by name."""

    def show(failure: Failure) -> str | None:
        record = find(failure.name)
        return None if record is None else jpeg_uri(_jpeg(of_record(FrameSource(record), failure.start_us, settings)))

    return show


def save_pictures(folder: Path, pictures: Iterable[tuple[Failure, np.ndarray]]) -> None:
    """Write pictures of windows. Raises StorageError."""
    for failure, picture in pictures:
        atomic.write_bytes(folder / failure.file, _jpeg(picture))


def pictures(
    data: "EvaluationData", found: Iterable[Failure], settings: WindowSettings, align: Align = "centre"
) -> Iterator[tuple[Failure, np.ndarray]]:
    """Each window once, with its picture; `settings` are those of the windows, `align` says how they lie on another
    sensor. Raises DataError."""
    wanted: dict[str, list[Failure]] = {}
    for failure in dict.fromkeys(failure._replace(p_slip=0.0) for failure in found):
        wanted.setdefault(failure.name, []).append(failure)
    cut = data.windows
    if cut is None:
        for record in data.named(wanted):
            source = FrameSource(record)  # what all pictures of a record share is made once
            for failure in wanted.pop(record.name, ()):
                yield failure, of_record(source, failure.start_us, settings, align)
        return
    for failure in (one for some in wanted.values() for one in some):
        for i in np.flatnonzero((cut.name == failure.name) & (cut.start_us == failure.start_us))[:1]:
            t_us, x, y, p = cut[int(i)].columns
            yield failure, of_events(Events(t_us.astype(np.int64), x, y, p), cut.settings)


def of_record(source: FrameSource, start_us: int, settings: WindowSettings, align: Align = "centre") -> np.ndarray:
    """A window's pictures side by side, cropped as the detector sees them; uint8 (height, width, 3)."""
    record = source.record
    lies = laid_on(settings, record.size, align)
    crop = slice(max(0, lies.top), lies.top + lies.height), slice(max(0, lies.left), lies.left + lies.width)
    times = _moments(start_us, round(settings.length_s * 1e6))
    return _beside([overlay(source.at_or_white(t), record.events.between(t - SHOWN_US, t))[crop] for t in times])


def of_events(events: Events, settings: WindowSettings) -> np.ndarray:
    """Pictures of a cut window, whose times and pixels count from its own corner; there is no frame."""
    times = _moments(0, round(settings.length_s * 1e6))
    blank = white(settings.width, settings.height)
    return _beside([overlay(blank, events.between(t_us - SHOWN_US, t_us)) for t_us in times])


def _jpeg(picture: np.ndarray) -> bytes:
    return encoded(picture, "JPEG", quality=80)


def _moments(start_us: int, length_us: int) -> list[int]:
    return [start_us + (2 * k + 1) * length_us // (2 * PICTURES) for k in range(PICTURES)]


def _beside(parts: Sequence[np.ndarray]) -> np.ndarray:
    gap = white(3, len(parts[0]))
    return np.hstack([piece for part in parts for piece in (part, gap)][:-1])
