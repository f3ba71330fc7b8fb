"""Recordings of real cameras, and samples of other simulators, as records of evslip."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from evslip.codecs import open_events
from evslip.codecs.formats import HDF5, format_of, known_suffixes
from evslip.codecs.source import extent_of
from evslip.data import record_file
from evslip.data.footage import Footage, footage_of
from evslip.data.intervals import Interval, Label, read_intervals
from evslip.data.record import Record, provenance
from evslip.data.record_file import is_record, read_recording
from evslip.events.stream import Events, concatenate
from evslip.exchange.importing_settings import Importing
from evslip.exchange.part import Part
from evslip.exchange.pose_files import even, read_poses, truth_of
from evslip.exchange.translation import Selection
from evslip.utils.errors import ConfigError, DataError

POSES, EVENTS, FRAMES = ("isaac_stats.csv", "poses.csv"), ("events_v2e", "events"), "frames"
"""Files of a simulator's folder, by name."""
VT_SNN = "prophesee_recordings"
VT_SNN_LABELS: dict[str, Label] = {"rotate": "slip", "rotation": "slip", "stable": "hold"}
"""Folder of the files of VT-SNN, and what the first word of their names says."""


def import_recording(source: str | Path, out: str | Path, how: Importing | None = None) -> Record:
    """Bring a recording of any known format, or a simulator's folder, into evslip's own format, at `out`.

    A recording's times are made to begin with its first event; a simulator's with its first pose. The record is kept in
    memory until it is written. Raises DataError, ConfigError, StorageError.
    """
    source, out, how = Path(source), Path(out), how or Importing()
    if out.suffix.lower() not in HDF5.suffixes:
        raise DataError(f"{out}: a record is an HDF5 file; its name must end in .h5 or .hdf5")
    made = simulated_elsewhere(source, how) if source.is_dir() else recorded(source, how)
    record_file.write(out, made)
    return made


def recorded(source: Path, how: Importing, from_zero: bool = True) -> Record:
    """The record of a file of events; one of evslip stays as it is, but for what `how` changes.

    from_zero: let the first event be at 0. Raises DataError.
    """
    known = read_recording(source)
    if known.kind != "recording":
        if how.labels is not None or how.part != Part():
            raise DataError(f"{source}: is a {known.kind} record; only recordings are labelled, cropped and turned")
        return known
    known = replace(known, size=_size_of(source, known, how.size))
    selection = Selection(how.part, known.size)
    zero_us = int(known.events.t_us[0]) if known.events.count and from_zero else 0
    events = selection.events(known.events, zero_us)
    footage = known.footage
    if footage is None and how.frames:
        footage = footage_of(_frames(source), source)
    if footage is not None and footage.images.shape[1:3] != known.size[::-1]:
        height, width = footage.images.shape[1:3]
        raise DataError(f"{source}: frames of {width}x{height} pixels, events of {known.size[0]}x{known.size[1]}")
    notes = {"file": source.name, "first_event_us": str(zero_us), "sensor": how.sensor, "mount": how.mount}
    made = replace(
        known,
        size=selection.size,
        events=events._replace(t_us=events.t_us - zero_us),
        footage=_turned(footage, selection, zero_us) if how.frames else None,
        notes=known.notes | {name: text for name, text in notes.items() if text and name not in known.notes},
    )
    return labelled(made, how.labels)


def labelled(record: Record, labels: Path | None) -> Record:
    """A recording with the intervals of a CSV file. Raises DataError, also for intervals beyond the recording."""
    if labels is None:
        return record
    intervals = read_intervals(labels)
    ends = [record.events.t_us[-1:]] + ([record.footage.t_us[-1:]] if record.footage is not None else [])
    last_us = int(np.concatenate(ends).max(initial=0))
    if intervals and intervals[-1].start_us > last_us:
        raise DataError(
            f"{labels}: an interval begins at {intervals[-1].start_us / 1e6:g} s, but the recording lasts "
            f"{last_us / 1e6:.3f} s; seconds count from its first event"
        )
    # What lies behind the last event is not known: no window may be cut there.
    return replace(record, intervals=tuple(i._replace(end_us=min(i.end_us, last_us + 1)) for i in intervals))


def simulated_elsewhere(folder: Path, how: Importing) -> Record:
    """The record of a folder of frames and poses, and perhaps events, of another simulator. Raises DataError.

    The folder, or one named data in it, holds isaac_stats.csv or poses.csv (see `poses`), frames/ with one image a
    row of that table, and perhaps events_v2e.txt or events in any other format. Frames have the sensor's size or are
    brought to it; where there are no events, evslip's camera looks at them.
    """
    home = next((place for place in (folder, folder / "data") if _poses_file(place) is not None), None)
    if home is None:
        raise DataError(
            f"{folder}: holds none of {', '.join(POSES)}, nor {VT_SNN}; expected a folder of a simulator, or a file"
        )
    table = _poses_file(home)
    assert table is not None  # it is how the place was found
    given, held = read_poses(table)
    zero_us = int(given.t_us[0])
    given = given._replace(t_us=given.t_us - zero_us)
    poses = even(given)
    if held is None:
        hangs = np.ones(len(poses.t_us), bool)
    else:
        hangs = held[np.searchsorted(given.t_us, poses.t_us, "right") - 1]
    pictures = _pictures(home / FRAMES, given.t_us, how.simulated_size)
    footage = footage_of(pictures, home / FRAMES)
    events, made_of = _events_of(home, zero_us, footage, how)
    size = how.simulated_size
    if events.count and (int(events.x.max()) >= size[0] or int(events.y.max()) >= size[1]):
        raise ConfigError(f"{home}: events beyond {size[0]} x {size[1]} pixels; expected --size of their sensor")
    selection = Selection(how.part, size)
    notes = {"file": folder.resolve().name, "events": made_of, "sensor": how.sensor, "mount": how.mount}
    made = Record(
        kind="recording",
        name=folder.resolve().name,
        size=selection.size,
        events=selection.events(events, 0),
        poses=poses,
        truth=truth_of(poses, hangs, how.centre_m),
        footage=_turned(footage, selection, 0) if how.frames else None,
        notes={name: text for name, text in notes.items() if text},
        provenance=provenance(),
    )
    return labelled(made, how.labels)


def import_vt_snn(
    folder: str | Path, out: str | Path, length_s: float = 0.15, size: tuple[int, int] | None = None
) -> list[Path]:
    """Bring the files rotate_*.mat and stable_*.mat of VT-SNN's layout into a folder of records, labelled throughout.
    Their times stay: 0 is the start of the window.

    length_s: how long a file lasts, since it does not say; longer, if its last event is later. size: width and height
    of the sensor; default: the extent of all files' events. Raises DataError, StorageError.
    """
    folder, out = Path(folder), Path(out)
    home = folder / VT_SNN if (folder / VT_SNN).is_dir() else folder
    files = sorted(home.glob("*.mat"))
    if not files:
        raise DataError(f"{home}: holds no .mat files, expected such as rotate_01_td.mat and stable_01_td.mat")
    common = size
    if common is None:
        width, height = zip(*(_extent(file) for file in files), strict=True)
        common = max(width), max(height)
    written = []
    for file in files:
        label = VT_SNN_LABELS.get(file.name.split("_")[0].lower())
        made = replace(recorded(file, Importing(frames=False, size=size), from_zero=False), size=common)
        if label is not None:
            last_us = int(made.events.t_us[-1]) if made.events.count else 0
            interval = Interval(0, max(round(length_s * 1e6), last_us + 1), label)
            made = replace(made, intervals=(interval,))
        written.append(out / f"{file.stem}.h5")
        record_file.write(written[-1], made)
    return written


def is_vt_snn(folder: Path) -> bool:
    """Whether a folder has VT-SNN's layout."""
    return (folder / VT_SNN).is_dir() or (folder.name == VT_SNN and folder.is_dir())


def _size_of(source: Path, known: Record, size: tuple[int, int] | None) -> tuple[int, int]:
    """The size of a recording's sensor: as its file states it, or else as a person does, or else its events' extent."""
    if size is None:
        return known.size
    stated = known.size if is_record(source) else open_events(source).size
    if stated is not None and stated != size:
        raise ConfigError(f"size: {source} states {stated[0]} x {stated[1]} pixels; expected no other size")
    if known.size[0] > size[0] or known.size[1] > size[1]:
        reach = f"{known.size[0]} x {known.size[1]}"
        raise ConfigError(f"size: {source} has events on {reach} pixels; expected a sensor of at least as many")
    return size


def _extent(file: Path) -> tuple[int, int]:
    source = open_events(file)
    return source.size or extent_of(source.parts)


def _poses_file(folder: Path) -> Path | None:
    return next((folder / name for name in POSES if (folder / name).is_file()), None)


def _frames(source: Path) -> Iterator[tuple[int, np.ndarray]]:
    frames = getattr(format_of(source).codec, "frames", None)
    return iter(()) if frames is None else frames(source)


def _turned(footage: Footage | None, selection: Selection, zero_us: int) -> Footage | None:
    if footage is None:
        return None
    images = np.stack([selection.image(image) for image in footage.images])
    return Footage(footage.t_us - zero_us, images)


def _pictures(folder: Path, t_us: np.ndarray, size: tuple[int, int]) -> Iterator[tuple[int, np.ndarray]]:
    from PIL import Image

    from evslip.codecs.clips.folder import image_files, read_image

    if not folder.is_dir():
        raise DataError(f"{folder}: no such folder; expected one image for each row of the poses")
    files = image_files(folder)
    if len(files) != len(t_us):
        raise DataError(f"{folder}: {len(files)} images for {len(t_us)} poses; expected one for each row")
    for time, file in zip(t_us.tolist(), files, strict=True):
        image = read_image(file)
        if image.dtype != np.uint8:
            raise DataError(f"{file}: {image.dtype} pixels, expected 8 bits a channel")
        if image.shape[:2] != size[::-1]:
            image = np.asarray(Image.fromarray(image).resize(size, Image.Resampling.BOX))
        yield time, image


def _events_of(folder: Path, zero_us: int, footage: Footage | None, how: Importing) -> tuple[Events, str]:
    """A simulator's events, or those that evslip makes of its frames, and where they are from."""
    names = (folder / f"{name}{suffix}" for name in EVENTS for suffix in known_suffixes())
    files = [path for path in names if path.is_file()]
    if files:
        source = open_events(files[0])
        stated = source.size
        events = concatenate(list(source.parts))
        if stated is not None and stated != how.simulated_size:
            raise ConfigError(f"{files[0]}: from a sensor of {stated[0]} x {stated[1]} pixels; expected --size of it")
        return events._replace(t_us=events.t_us - zero_us), files[0].name
    if footage is None:
        raise DataError(f"{folder}: neither events nor frames")
    from evslip.codecs.clips.grey import to_grey
    from evslip.events.camera import EventCamera

    camera = EventCamera(how.camera, size=how.simulated_size, seed=how.seed, intensity="uint8")
    images = (to_grey(image, "uint8") for image in footage.images)
    return camera.run(zip(footage.t_us.tolist(), images, strict=True)), f"made by evslip, camera {how.camera}"
