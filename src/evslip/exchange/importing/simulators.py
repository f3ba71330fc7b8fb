"""A folder of frames and poses, and perhaps events, of another simulator as a record."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from evslip.codecs import open_events
from evslip.codecs.clips.folder import image_files, read_image
from evslip.codecs.clips.grey import to_grey
from evslip.codecs.formats import known_suffixes
from evslip.data.footage import Footage, footage_of
from evslip.data.record import Record, provenance
from evslip.events.stream import Events, concatenate
from evslip.exchange.importing.labels import labelled
from evslip.exchange.importing.pose_files import even, read_poses, truth_of
from evslip.exchange.importing.settings import Importing
from evslip.exchange.selector import Selector
from evslip.exchange.vt_snn import VT_SNN
from evslip.utils.errors import ConfigError, DataError

POSES, EVENTS, FRAMES = ("isaac_stats.csv", "poses.csv"), ("events_v2e", "events"), "frames"
"""Files of a simulator's folder, by name."""
CAMERA, SIZE = "davis346", (346, 260)
"""The event camera that looks at a simulator's frames, and its width and height, where nobody says another."""


def read_simulator_folder(folder: Path, how: Importing) -> Record:
    """The record of a folder of frames and poses, and perhaps events, of another simulator. Raises DataError.

    The folder, or one named data in it, holds isaac_stats.csv or poses.csv (see `pose_files`), frames/ with one image a
    row of that table, and perhaps events_v2e.txt or events in any other format. Frames have the sensor's size or are
    brought to it; where there are no events, evslip's camera looks at them.
    """
    tables = [place / name for place in (folder, folder / "data") for name in POSES if (place / name).is_file()]
    if not tables:
        raise DataError(
            f"{folder}: holds none of {', '.join(POSES)}, nor {VT_SNN}; expected a folder of a simulator, or a file"
        )
    home, size = tables[0].parent, how.size or SIZE
    given, held = read_poses(tables[0])
    zero_us = int(given.t_us[0])
    given = given._replace(t_us=given.t_us - zero_us)
    poses = even(given)
    last = np.searchsorted(given.t_us, poses.t_us, "right") - 1
    hangs = np.ones(len(poses.t_us), bool) if held is None else held[last]
    pictures = _pictures(home / FRAMES, given.t_us, size)
    footage = footage_of(pictures, home / FRAMES)
    events, made_of = _events_of(home, zero_us, footage, size, how)
    if events.count and (int(events.x.max()) >= size[0] or int(events.y.max()) >= size[1]):
        raise ConfigError(f"{home}: events beyond {size[0]} x {size[1]} pixels; expected --size of their sensor")
    selector = Selector(how.selection, size)
    notes = {"file": folder.resolve().name, "events": made_of, "sensor": how.sensor, "mount": how.mount}
    made = Record(
        kind="recording",
        name=folder.resolve().name,
        size=selector.size,
        events=selector.events(events, 0),
        poses=poses,
        truth=truth_of(poses, hangs, how.centre_m),
        footage=selector.footage(footage) if how.frames else None,
        notes={name: text for name, text in notes.items() if text},
        provenance=provenance(),
    )
    return labelled(made, how.labels, (int(events.t_us[0]), int(events.t_us[-1])) if events.count else None)


def _pictures(folder: Path, t_us: np.ndarray, size: tuple[int, int]) -> Iterator[tuple[int, np.ndarray]]:
    from PIL import Image

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


def _events_of(
    folder: Path, zero_us: int, footage: Footage | None, size: tuple[int, int], how: Importing
) -> tuple[Events, str]:
    """A simulator's events, or those that evslip makes of its frames, and where they are from."""
    names = (folder / f"{name}{suffix}" for name in EVENTS for suffix in known_suffixes())
    files = [path for path in names if path.is_file()]
    if files:
        source = open_events(files[0])
        stated = source.size
        events = concatenate(list(source.parts))
        if stated is not None and stated != size:
            raise ConfigError(f"{files[0]}: from a sensor of {stated[0]} x {stated[1]} pixels; expected --size of it")
        return events.replace(t_us=events.t_us - zero_us), files[0].name
    if footage is None:
        raise DataError(f"{folder}: neither events nor frames")
    from evslip.events.camera import EventCamera

    name = how.camera or CAMERA
    camera = EventCamera(name, size=size, seed=how.seed, intensity="uint8")
    images = (to_grey(image, "uint8") for image in footage.images)
    return camera.run(zip(footage.t_us.tolist(), images, strict=True)), f"made by evslip, camera {name}"
