"""A whole sample in one bag: events, poses, frames, forces and the truth about slip, each on a topic of its own."""

from collections.abc import Iterable, Iterator, Sequence
from heapq import merge
from pathlib import Path
from typing import NamedTuple

import numpy as np

from evslip.codecs.formats import FORMATS, format_of
from evslip.codecs.ros.bag_writer import BagWriter
from evslip.codecs.ros.composer import NUMBER, TEXT, Composer
from evslip.codecs.ros.messages import FLAG, IMAGE
from evslip.codecs.ros.packing import EventPacker, Message, of_camera
from evslip.codecs.ros.topics import HELD, IMAGES
from evslip.data.record import Record
from evslip.events.stream import Events
from evslip.exchange.sample_geometry import geometry
from evslip.physics.truth import Truth
from evslip.utils import atomic
from evslip.utils.errors import ConfigError

PARAMETERS, LABEL = "/sample/parameters", "/slip/label"
GRIP_FORCE, SLIPPING = "/gripper/grip_force_n", "/slip/slipping"
ROTATION, SLIDE = "/slip/rotation_deg", "/slip/slide_mm"
FRAMES_HZ = 30.0
"""Frames a second of a simulated sample, which keeps none: they are drawn again from its poses."""


def is_bag(path: Path) -> bool:
    """Whether a file that is written to this name is a bag. Raises DataError."""
    return format_of(path, writing=True) in [form for form in FORMATS if form.name in ("rosbag", "rosbag2")]


class View(NamedTuple):
    """A record as one camera has it."""

    record: Record
    parts: Iterable[Events]
    """Its events, part by part."""
    camera: str | None = None
    """Name of the camera, where the sample has several."""


def write_sample(path: Path, views: Sequence[View], frames_hz: float = FRAMES_HZ) -> int:
    """Write a record as a bag, whole or not at all. Returns the number of messages.

    views: one, or one of each camera; frames_hz: frames a second of a simulated sample, 0 for none; those of a
    recording are taken as they are. Raises ConfigError, DataError, StorageError, MissingExtraError.
    """
    if not 0 <= frames_hz <= 1000:
        raise ConfigError(f"frames-hz: {frames_hz:g} is out of range, expected 0 to 1000")
    count = 0
    with atomic.staged(path) as file:
        bag = BagWriter(path)
        try:
            composer, record = Composer(bag.cdr), views[0].record
            packers = [EventPacker(path, view.record.size, bag.cdr, view.camera) for view in views]
            streams = [
                *(_events(packer, view.parts) for packer, view in zip(packers, views, strict=True)),
                _about(composer, record),
                geometry(bag.cdr, {view.camera: view.record for view in views}),
                _truth(composer, record),
                *(_images(bag.cdr, view, frames_hz) for view in views),
            ]
            for message in merge(*streams, key=lambda message: message[2]):
                bag.put(*message)
                count += 1
            bag.finish(file)
        except BaseException:
            bag.abandon()
            raise
    return count


def _events(packer: EventPacker, parts: Iterable[Events]) -> Iterator[Message]:
    for events in parts:
        yield from packer.push(events)
    yield from packer.rest()


def _about(composer: Composer, record: Record) -> Iterator[Message]:
    yield LABEL, TEXT, 0, composer.value(TEXT, record.label)
    if record.params is not None:
        yield PARAMETERS, TEXT, 0, composer.value(TEXT, record.params.model_dump_json())


def _truth(composer: Composer, record: Record) -> Iterator[Message]:
    truth = record.truth
    if truth is None:
        return
    slipping, spin_deg, slide_mm = slipping_of(truth), truth.spin_deg, truth.slide_mm
    force = None if record.trajectory is None else record.trajectory.pad_force_n.mean(1)
    for k, t_us in enumerate(truth.t_us.tolist()):
        yield HELD, FLAG, t_us, composer.value(FLAG, bool(truth.held[k]))
        yield SLIPPING, FLAG, t_us, composer.value(FLAG, bool(slipping[k]))
        if truth.span_us[0] <= t_us <= truth.span_us[1]:  # before it closed, the grip had no movement
            yield ROTATION, NUMBER, t_us, composer.value(NUMBER, float(spin_deg[k]))
            yield SLIDE, NUMBER, t_us, composer.value(NUMBER, float(slide_mm[k]))
        if force is not None:
            yield GRIP_FORCE, NUMBER, t_us, composer.value(NUMBER, float(force[k]))


def slipping_of(truth: Truth) -> np.ndarray:
    """Whether the object slips at each time of the truth; bool of shape (n,)."""
    slipping = np.zeros(len(truth.t_us), bool)
    for episode in truth.episodes:
        slipping |= (truth.t_us >= episode.start_us) & (truth.t_us < episode.end_us)
    return slipping


def _images(cdr: bool, view: View, frames_hz: float) -> Iterator[Message]:
    topic, composer = of_camera(IMAGES, view.camera), Composer(cdr, view.camera)
    for t_us, image in frames_of(view.record, frames_hz):
        if t_us >= 0:
            yield topic, IMAGE, t_us, composer.image(t_us, image)


def frames_of(record: Record, frames_hz: float) -> Iterator[tuple[int, np.ndarray]]:
    """Times in microseconds and frames, uint8 of shape (h, w) or (h, w, 3): those of a recording, or those that are
    drawn of a sample's poses, from the closed grip on."""
    if record.footage is not None:
        yield from zip(record.footage.t_us.tolist(), record.footage.images, strict=True)
    elif record.trajectory is not None and record.truth is not None and frames_hz:
        from evslip.rendering.still_frames import StillFrames
        from evslip.scene.textures.library import linear_to_srgb

        pictures = StillFrames(record.trajectory)
        start, end = record.truth.span_us
        for t_us in np.arange(start, end, 1e6 / frames_hz).astype(np.int64).tolist():
            light = np.clip(pictures.at(t_us).luminance, 0.0, 1.0)
            yield t_us, np.round(linear_to_srgb(light) * 255).astype(np.uint8)
