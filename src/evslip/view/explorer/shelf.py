"""Records to look at: the samples of a data set, or one recording."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from evslip.codecs import format_of, raw_source
from evslip.codecs.arrays.record_head import wrong_camera
from evslip.codecs.formats import is_bag_folder, stem_of
from evslip.data import record_file
from evslip.data.record import Record
from evslip.data.record_file import ALL_CAMERAS, camera_names_in, is_record, read_recording
from evslip.data.recordings import open_samples
from evslip.data.samples import Listing, Samples
from evslip.utils.errors import DataError
from evslip.view.report.facts import doubt_of, facts_of


class Shelf:
    """Items in order. They are named by their position, so that no path ever comes from outside."""

    def __init__(self, title: str, items: list[Listing]):
        self.title, self.items = title, items

    def __len__(self) -> int:
        return len(self.items)

    def read(self, position: int, events: bool = True) -> Record:
        """The record of an item; events=False leaves a sample's stream on disk. Raises DataError, IndexError."""
        item = self.items[position]
        camera = item.camera
        record = record_file.read(item.path, events, camera) if item.split else read_recording(item.path, camera)
        return record if camera is None else replace(record, name=f"{record.name}-{camera}")

    def facts(self, first: int, count: int) -> Iterator[dict[str, Any]]:
        """Facts in the files of some items beyond the list: see `facts_of`, and what makes them doubtful. A file that
        cannot be read says why."""
        for position in range(max(0, first), min(first + count, len(self.items))):
            item = self.items[position]
            if item.split:
                try:
                    facts = facts_of(self.read(position, events=False))
                    yield {"position": position, **facts, "doubt": doubt_of(item.label or "", facts)}
                except DataError as error:
                    yield {"position": position, "doubt": str(error)}


def open_shelf(path: Path, camera: str = ALL_CAMERAS) -> Shelf:
    """A data set, a folder of recordings, or a file of events of any known format; of samples that several cameras saw
    an item of each, or those of one. Raises DataError."""
    if path.is_file() or is_bag_folder(path):
        return open_recording(path, camera)
    samples = open_samples(path).seen_by(camera)
    if not samples.listing:
        raise DataError(f"{path}: the data set has no sample yet; make some with `evslip generate`")
    return Shelf(path.absolute().name, [_item(samples, position) for position in range(len(samples))])


def _item(samples: Samples, position: int) -> Listing:
    one = samples.listing[position]
    if one.camera is not None:
        one = one._replace(name=f"{one.name}-{one.camera}")
    # Of a recording without its events, which would be all that the folder holds.
    return one if one.label is not None else one._replace(label=samples.read(position, events=False).label)


def open_recording(path: Path, camera: str = ALL_CAMERAS) -> Shelf:
    """One file of events of any known format; camera: as of `open_shelf`. Raises DataError."""
    format_of(path)
    if not (path.is_file() or is_bag_folder(path)):
        raise DataError(f"{path}: no such file; expected a recording")
    if not is_record(path):
        next(iter(raw_source(path).parts), None)  # what cannot be read is refused before a page opens
    names = camera_names_in(path) if is_record(path) else ()
    if not names and camera == ALL_CAMERAS:
        return Shelf(path.name, [Listing(path, stem_of(path), label="")])
    if camera != ALL_CAMERAS and camera not in names:
        raise DataError(f"{path}: {wrong_camera(names, camera)}")
    chosen = [name for name in names if camera in (name, ALL_CAMERAS)]
    return Shelf(path.name, [Listing(path, f"{stem_of(path)}-{name}", label="", camera=name) for name in chosen])
