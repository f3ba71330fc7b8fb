"""Cost of a sample before it is made, and refusal of one that cannot fit.

Events are counted from the noise that the parameters ask for, and what movement adds on average; measured on the
presets (docs/explanation/benchmarks.md) and right to a factor of 3.
"""

import contextlib
import math
import os
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from evslip.config.params import Params
from evslip.events.pixel_model import PixelModel
from evslip.generation.runners.local import crew_size
from evslip.generation.sensor import pixels_of, readout_of
from evslip.physics.motion.phases import phase_times
from evslip.rendering import MIDDLE_GREY
from evslip.rendering.timing.flicker import DARK, Flicker
from evslip.utils.errors import ConfigError

MOVING_EVENTS = 40.0
"""Events of a pixel that movement makes, in `simple`."""
BASE_BYTES, PIXEL_BYTES, EVENT_BYTES, STORED_BYTES = 4e8, 250.0, 45.0, 3.1
"""Memory of a process, for each pixel, for each event; size of an event in a file."""
FRAMES, PIXEL_S, MIXED_S, EVENT_S = 1500.0, 45e-9, 6e-9, 3e-7
"""Frames of a sample 346 pixels wide at 0.5 pixels a frame; processor time of a pixel of a frame, of a pixel of a frame
that a flicker adds, and of an event."""
LARGE_BYTES, LARGE_S, LARGE_DISK = 2e9, 300.0, 1e11
"""Memory and time of a sample, and size of a data set, from which on a person reads them before it starts."""


class Estimate(NamedTuple):
    """Cost of a sample."""

    events: float
    file_bytes: float
    memory_bytes: float
    seconds: float

    def line(self) -> str:
        """One line for a person."""
        return (
            f"a sample takes about {self.events / 1e6:,.0f} million events, {_bytes(self.file_bytes)} on disk, "
            f"{_bytes(self.memory_bytes)} of memory and {_time(self.seconds)} of processor time"
        )


def estimate(params: Params) -> Estimate:
    """Cost of the sample of these parameters."""
    camera, render = params.camera, params.render
    pixels, seconds = camera.width * camera.height, max(end for _, end in phase_times(params).values()) / 1e6
    model = pixels_of(params)
    noise_hz = model.noise_hz(pixels) + readout_of(params).burst_events_hz(camera.width, camera.height)
    flicker = Flicker(params)
    events = (noise_hz + pixels * _flicker_hz(params, model)) * seconds + pixels * MOVING_EVENTS
    frames = max(seconds * render.min_rate_hz, FRAMES * camera.width / 346 * 0.5 / render.max_motion_px)
    mixed = len(flicker.times(np.array([0, 1_000_000]))) * seconds if flicker.is_on else 0.0
    return Estimate(
        events,
        events * STORED_BYTES,
        BASE_BYTES + pixels * PIXEL_BYTES + events * EVENT_BYTES,
        (frames * PIXEL_S + mixed * MIXED_S) * pixels + events * EVENT_S,
    )


def together(each: Sequence[Estimate]) -> Estimate:
    """Cost of a sample of several cameras, one after the other."""
    process = BASE_BYTES * (len(each) - 1)
    events, stored, memory, seconds = (sum(column) for column in zip(*each, strict=True))
    return Estimate(events, stored, memory - process, seconds)


def _flicker_hz(params: Params, model: PixelModel) -> float:
    """Events a second of a pixel that sees only the light that flickers most: what passes its low-pass, at a brightness
    of MIDDLE_GREY, in whole thresholds."""
    own = params.flicker
    depth = min(max(own.lamp_depth, own.surroundings_depth), 1 - DARK)
    theta = model.theta if model.theta_on is None else float(np.mean(model.theta_on))
    passed = 1 / math.hypot(1, own.frequency_hz / (model.cutoff_hz * MIDDLE_GREY)) if model.cutoff_hz > 0 else 1.0
    return 2 * own.frequency_hz * math.floor(2 * math.atanh(depth) * passed / theta)


def require_room(one: Estimate | None, count: int, workers: int | None, root: Path) -> str | None:
    """A line for a person before `count` samples are made on this machine, if they are large. Raises ConfigError where
    not even one of them fits into the memory, or all of them into three times the free disk."""
    if one is None:
        return None
    there, free = installed_memory(), free_disk(root)
    if one.memory_bytes > there:
        raise ConfigError(
            f"{one.line()}, and this machine has {_bytes(there)}: expected fewer pixels (camera.width, camera.height), "
            "less noise (sensor.shot_rate_hz, sensor.leak_rate_hz) or flicker, or a shorter motion (motion.duration_s)"
        )
    if count * one.file_bytes > 3 * free:
        raise ConfigError(
            f"{one.line()}; {count:,} of them {_bytes(count * one.file_bytes)}, and {_bytes(free)} are free in {root}: "
            "expected fewer or smaller ones, or parts (I/N) on several disks"
        )
    crew = crew_size(count, workers)
    large = crew * one.memory_bytes > there or one.memory_bytes > LARGE_BYTES or one.seconds > LARGE_S
    if not large and count * one.file_bytes < LARGE_DISK:
        return None
    hint = f"; {crew} at once take more memory than the machine's {_bytes(there)}: fewer workers may be faster"
    return f"{one.line()}; {count:,} of them {_bytes(count * one.file_bytes)}" + (
        hint if crew * one.memory_bytes > there else ""
    )


def installed_memory() -> float:
    """Bytes of memory of this machine, or of the part of it that this process may use."""
    bounds = [float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))]
    with contextlib.suppress(OSError, ValueError):  # no control group, or one without a bound
        bounds.append(float(Path("/sys/fs/cgroup/memory.max").read_text()))
    return min(bounds)


def free_disk(root: Path) -> float:
    """Bytes that are free where a folder is, or will be."""
    there = next(folder for folder in (root, *root.absolute().parents) if folder.exists())
    return float(shutil.disk_usage(there).free)


def _bytes(number: float) -> str:
    unit, size = next((pair for pair in (("TB", 1e12), ("GB", 1e9)) if number >= pair[1]), ("MB", 1e6))
    return f"{number / size:,.3g} {unit}"


def _time(seconds: float) -> str:
    units = (("days", 86400), ("h", 3600), ("min", 60))
    unit, size = next((pair for pair in units if seconds >= 2 * pair[1]), ("s", 1))
    return f"{seconds / size:,.2g} {unit}"
