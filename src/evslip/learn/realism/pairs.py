"""Real and simulated events of one scene, from two files, or from a recording and a camera that sees its frames."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from evslip.codecs import open_events
from evslip.codecs.clips.pixels import check_sensor
from evslip.data.record import Record
from evslip.data.record_file import read_recording
from evslip.events.stream import Events
from evslip.exchange.importing.event_files import read_event_file
from evslip.exchange.importing.settings import Importing
from evslip.learn.realism.realism import Pair
from evslip.learn.realism.settings import RealismSettings
from evslip.learn.realism.simulation import simulated_events
from evslip.utils.errors import ConfigError, DataError


def pair_of_preset(recording: Path, preset: str, settings: RealismSettings) -> Pair:
    """A recording's events, and those of two draws of a simulated camera that sees its frames. Times count from the
    recording's first event. Raises DataError, ConfigError, MissingExtraError."""
    real, _ = real_recording(recording)
    if real.footage is None or len(real.footage.t_us) < 2:
        raise DataError(
            f"{recording}: has no frames that a camera could see; expected a recording with frames, or a second file, "
            "of simulated events"
        )
    frames_us = real.footage.t_us
    start_us, end_us = _stretch(settings, max(0, int(frames_us[0])), min(_end(real.events), int(frames_us[-1])))
    if start_us < frames_us[0] or end_us > frames_us[-1]:
        first_s, last_s = frames_us[0] / 1e6, frames_us[-1] / 1e6
        raise ConfigError(
            f"start-s, end-s: {start_us / 1e6:g} to {end_us / 1e6:g} s; expected a stretch within that of the frames, "
            f"{first_s:.3f} to {last_s:.3f} s"
        )
    seeds = (settings.seed, settings.seed + 1)
    simulated, other = simulated_events(real.footage, preset, seeds, settings.for_preset(preset), end_us)
    return Pair(real.events, simulated, real.size, start_us, end_us, real.footage, other)


def pair_of_files(recording: Path, simulation: Path, settings: RealismSettings) -> Pair:
    """The events of two files. Times count from the recording's first event, also those of the simulation, if the two
    have any time in common; else both from their own first event. Raises DataError, ConfigError."""
    (real, zero_us), simulated = real_recording(recording), read_recording(simulation)
    size = _common_size({recording: real, simulation: simulated})
    events = simulated.events
    if not len(events):
        raise DataError(f"{simulation}: holds no events; expected those of a simulation")
    on_one_clock = int(events.t_us[0]) < zero_us + _end(real.events) and int(events.t_us[-1]) >= zero_us
    events = events.replace(t_us=events.t_us - (zero_us if on_one_clock else events.t_us[0]))
    start_us, end_us = _stretch(settings, max(0, int(events.t_us[0])), min(_end(real.events), _end(events)))
    return Pair(real.events, events, size, start_us, end_us, real.footage)


def real_recording(path: Path) -> tuple[Record, int]:
    """A recording whose first event is at 0, and the time of that on its own clock."""
    record = read_event_file(path, Importing(), from_zero=False)
    check_sensor(record.size, path)
    if not len(record.events):
        raise DataError(f"{path}: holds no events; expected those of a real sensor")
    zero_us, footage = int(record.events.t_us[0]), record.footage
    footage = footage and footage._replace(t_us=footage.t_us - zero_us)
    return replace(record, events=record.events.replace(t_us=record.events.t_us - zero_us), footage=footage), zero_us


def _common_size(records: dict[Path, Record]) -> tuple[int, int]:
    """Size of the sensor of all files; those that do not state it have it from the others."""
    stated = {path: size for path in records if (size := open_events(path).size) is not None}
    sizes = list(stated.values()) or [record.size for record in records.values()]
    width, height = (max(sides) for sides in zip(*sizes, strict=True))
    for path, record in records.items():
        if record.size[0] > width or record.size[1] > height or stated.get(path, (width, height)) != (width, height):
            raise DataError(
                f"{path}: a sensor of {record.size[0]}x{record.size[1]} pixels, the other file's has {width}x{height}; "
                "expected two of one size"
            )
    return width, height


def _stretch(settings: RealismSettings, first_us: int, last_us: int) -> tuple[int, int]:
    """Start and end of what is scored, us."""
    start = first_us if settings.start_s is None else settings.start_s * 1e6
    end = last_us if settings.end_s is None else settings.end_s * 1e6
    if not (np.isfinite([start, end]).all() and 0 <= start < end < 2**62):
        raise ConfigError(
            f"start-s, end-s: {start / 1e6:g} to {end / 1e6:g} s; expected a start from 0 on and an end after it, "
            "seconds after the recording's first event"
        )
    return round(start), round(end)


def _end(events: Events) -> int:
    return int(events.t_us[-1]) + 1
