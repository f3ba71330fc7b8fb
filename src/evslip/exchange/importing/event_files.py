"""A file of events of a real camera as a record."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from evslip.codecs import open_events
from evslip.codecs.formats import format_of
from evslip.codecs.frames import frames_of
from evslip.codecs.ros.topics import GRIPPER, HELD, OBJECT, TOOL
from evslip.data.footage import footage_of
from evslip.data.record import Poses, Record
from evslip.data.record_file import is_record, read_recording
from evslip.exchange.importing.labels import labelled
from evslip.exchange.importing.pose_files import check_poses, check_span, even, truth_of
from evslip.exchange.importing.settings import Importing
from evslip.exchange.selection import Selection
from evslip.exchange.selector import Selector
from evslip.utils.errors import ConfigError, DataError


def read_event_file(source: Path, how: Importing, from_zero: bool = True) -> Record:
    """The record of a file of events; one of evslip stays as it is, but for what `how` changes.

    from_zero: let the first event be at 0. Raises DataError.
    """
    known = read_recording(source, how.camera)
    if known.kind != "recording":
        if how.labels is not None or how.selection != Selection():
            raise DataError(f"{source}: is a {known.kind} record; only recordings are labelled, cropped and turned")
        return known
    known = replace(known, size=_size_of(source, known, how))
    selector = Selector(how.selection, known.size)
    poses = known.poses or poses_of(source)
    starts = [int(part.t_us[0]) for part in (known.events, poses) if part is not None and len(part.t_us)]
    # A record's time has begun already: its labels, poses and truth count in it.
    zero_us = 0 if is_record(source) or not from_zero else min(starts, default=0)
    events = selector.events(known.events, zero_us)
    footage = known.footage
    if footage is None and how.frames:
        footage = footage_of(frames_of(source, how.camera), source)
    if footage is not None and footage.images.shape[1:3] != known.size[::-1]:
        height, width = footage.images.shape[1:3]
        raise DataError(f"{source}: frames of {width}x{height} pixels, events of {known.size[0]}x{known.size[1]}")
    truth = known.truth
    if poses is not None and known.poses is None:
        given = poses._replace(t_us=poses.t_us - zero_us)
        poses = even(given)
        held = np.array(list(format_of(source).codec.flags(source, HELD)), bool)
        # Without a word on when the object hangs in the grip, what moves before and after would count as slip.
        if len(held) == len(given.t_us) and held.any():
            last = np.searchsorted(given.t_us, poses.t_us, "right") - 1
            truth = truth_of(poses, held[last], how.centre_m or _tool_centre(source))
    notes = {"file": source.name, "first_event_us": str(zero_us), "sensor": how.sensor, "mount": how.mount}
    made = replace(
        known,
        size=selector.size,
        events=events.replace(t_us=events.t_us - zero_us),
        footage=selector.footage(footage, zero_us) if how.frames else None,
        poses=poses,
        truth=truth,
        notes=known.notes | {name: text for name, text in notes.items() if text and name not in known.notes},
    )
    t_us = known.events.t_us
    return labelled(made, how.labels, (int(t_us[0]) - zero_us, int(t_us[-1]) - zero_us) if len(t_us) else None)


def _size_of(source: Path, known: Record, how: Importing) -> tuple[int, int]:
    """The size of a recording's sensor: as its file states it, or else as a person does, or else its events' extent."""
    size = how.size
    if size is None:
        return known.size
    stated = known.size if is_record(source) else open_events(source, how.camera).size
    if stated is not None and stated != size:
        raise ConfigError(f"size: {source} states {stated[0]} x {stated[1]} pixels; expected no other size")
    if known.size[0] > size[0] or known.size[1] > size[1]:
        reach = f"{known.size[0]} x {known.size[1]}"
        raise ConfigError(f"size: {source} has events on {reach} pixels; expected a sensor of at least as many")
    return size


def poses_of(source: Path) -> Poses | None:
    """Poses of gripper and object in a bag, at the gripper's times; None where it does not have both. Raises
    DataError."""
    read = getattr(format_of(source).codec, "poses", None)
    tables = [] if read is None else [list(read(source, topic)) for topic in (GRIPPER, OBJECT)]
    if not all(tables) or not tables:
        return None
    (times, gripper), (others, thing) = (map(np.array, zip(*table, strict=True)) for table in tables)
    t_us = times.astype(np.int64)
    if not np.array_equal(t_us, others) or (np.diff(t_us) <= 0).any():
        raise DataError(
            f"{source}: the poses of {GRIPPER} and {OBJECT} are not of the same, growing times; expected one of each "
            "at a time"
        )
    check_span(t_us, source)
    for topic, table in ((GRIPPER, gripper), (OBJECT, thing)):
        check_poses(table, f"{source}: {topic}")
    return Poses(t_us, gripper.astype(np.float32), thing.astype(np.float32))


def _tool_centre(source: Path) -> tuple[float, ...] | None:
    """The point between the fingers in the gripper's frame, in metres, if a bag tells it. Raises DataError."""
    tool = next(iter(format_of(source).codec.poses(source, TOOL)), None)
    if tool is None:
        return None
    check_poses(np.array([tool[1]]), f"{source}: {TOOL}")
    return tool[1][:3]
