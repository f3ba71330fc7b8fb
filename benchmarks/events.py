"""Speed of the event camera, one thread: benchmarks/events.py [--clip KIND ...] [--cameras NAME ...] [--repeat N]
[--v2e FOLDER] [--eventcv] [--every N ...] [--frames N]

--clip rendered, the default, takes what `evslip generate` feeds it with: 120 frames in a row from the middle of the
transport of samples 0 of `simple` and 2 of `complex`, rendered here, where nearly every pixel changes in every frame.
"ns an event" is the time for floats shared among the events, looking at the pixels without one included. --every 1 2 4
takes only each of these frames, so that each moves further.

--clip square busy are kinder: a textured square turns at 2 revolutions a second before a gradient, filmed at 2000
frames a second. In "square" the texture goes from bytes of 20 to 255, in "busy" from 2 to 255 and through steeper
edges, which makes twice the events, or half as many again where there is a low-pass. --frames says how many of these.

Every figure is the best of some runs, and for all but the first frame, on which a camera settles. On one thread the
processor's time is taken, so that other programs disturb less. "bytes" and "floats" are Mpixel/s for frames in uint8
and linear float32, "step" milliseconds for a frame of bytes; "events" counts them per pixel and frame.

--v2e FOLDER times v2e too, on the same frames as bytes, and prints ratios: FOLDER is a copy of
https://github.com/SensorsINI/v2e, which needs torch and opencv-python; what else it imports but does not use here is
replaced by empty modules. --eventcv times that package (pip install eventcv) on the same bytes, on one thread
too, without its upsampling, which costs a pass over all pixels for each finer step. It decodes sRGB: its events differ.
"""

import argparse
import importlib
import itertools
import logging
import os
import resource
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple
from unittest.mock import MagicMock

import numpy as np

from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.events import PRESETS, EventCamera
from evslip.physics.motion.phases import phase_times
from evslip.physics.simulation import simulate
from evslip.physics.truth import measure
from evslip.rendering import render

SAMPLES = (("simple", 0), ("complex", 2))
RENDERED_FRAMES = 120
SIZES = ((346, 260), (640, 480), (1280, 720))
FRAME_US = 500.0
LEAST_S = 0.3
PASSES = 4
CLIPS = {"square": (20, 1.0), "busy": (2, 1.3)}
"""Darkest byte of the texture, and how much its contrast is raised."""


class Film(NamedTuple):
    """Frames to turn into events."""

    name: str
    times_us: np.ndarray
    floats: np.ndarray
    """Linear luminance, float32 of shape (frames, height, width)."""

    @property
    def in_bytes(self) -> np.ndarray:
        return (255 * np.clip(self.floats, 0, 1)).astype(np.uint8)


def rendered_films(every: list[int]) -> Iterator[Film]:
    """Frames of SAMPLES from the middle of their transport, at the times that `evslip generate` draws."""
    for preset, index in SAMPLES:
        traj = simulate(draw(load_config(preset), index))
        middle_us = sum(phase_times(traj.params).get("move", measure(traj).span_us)) // 2
        frames = list(itertools.islice(render(traj, start_us=middle_us), RENDERED_FRAMES))
        times_us = np.array([frame.t_us for frame in frames], float)
        floats = np.stack([frame.luminance for frame in frames])
        for step in every:
            name = f"{preset} {index}" + (f", 1 frame of {step}" if step > 1 else "")
            yield Film(name, times_us[::step], np.ascontiguousarray(floats[::step]))


def kind_films(kind: str, frames: int) -> Iterator[Film]:
    for size in SIZES:
        yield Film(f"{kind} {size[0]}x{size[1]}", FRAME_US * np.arange(frames), make_clip(size, frames, kind))


def make_clip(size: tuple[int, int], frames: int, kind: str = "square") -> np.ndarray:
    """Linear luminance, float32 of shape (frames, height, width); kind: of CLIPS."""
    width, height = size
    rng = np.random.default_rng(1)
    darkest, overshoot = CLIPS[kind]
    texture = rng.uniform(darkest / 255, 1.0, (14, 14))
    # Contrast beyond black and white, as a sharp picture's edges have it.
    texture = np.clip(0.5 + overshoot * (texture - 0.5), darkest / 255, 1.0)
    rows, columns = np.mgrid[0:height, 0:width] - np.array([height, width])[:, None, None] / 2
    ground = np.broadcast_to(np.linspace(8 / 255, 180 / 255, width), (height, width))
    half = 0.21 * min(size)
    clip = np.empty((frames, height, width), np.float32)
    for number, image in enumerate(clip):
        angle = 2 * np.pi * 2 * number * FRAME_US * 1e-6
        u = columns * np.cos(angle) + rows * np.sin(angle)
        v = rows * np.cos(angle) - columns * np.sin(angle)
        cover = np.clip(half - np.maximum(np.abs(u), np.abs(v)) + 0.5, 0, 1)
        image[...] = ground * (1 - cover) + _smooth(texture, (u / half + 1) * 6, (v / half + 1) * 6) * cover
    return clip


def _smooth(texture: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    u, v = np.clip(u, 0, 12.999), np.clip(v, 0, 12.999)
    i, j = u.astype(int), v.astype(int)
    a, b = u - i, v - j
    top = texture[i, j] * (1 - a) + texture[i + 1, j] * a
    bottom = texture[i, j + 1] * (1 - a) + texture[i + 1, j + 1] * a
    return top * (1 - b) + bottom * b


def best(
    work: Callable[[], object],
    repeat: int,
    prepare: Callable[[], object] = lambda: None,
) -> float:
    """Shortest time of some calls, in seconds; each comes after a call of `prepare` that is not timed.

    Short calls are repeated until they have taken LEAST_S together: single ones are easily disturbed.
    """
    times: list[float] = []
    while len(times) < repeat or sum(times) < LEAST_S:
        prepare()
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return min(times)


def measure_camera(
    name: str, clip: np.ndarray, times_us: np.ndarray, repeat: int, **arguments
) -> tuple[float, float, float]:
    """Mpixel/s of `run`, milliseconds a `step`, events per pixel and frame."""
    size = (clip.shape[2], clip.shape[1])
    intensity = "uint8" if clip.dtype == np.uint8 else "linear"
    camera = EventCamera(name, size=size, intensity=intensity, **arguments)
    camera.run(zip(times_us[:3], clip, strict=False))
    events = 0

    def prepare() -> None:
        camera.reset()
        camera.step(times_us[0], clip[0])

    def run() -> None:
        nonlocal events
        events = camera.run(zip(times_us[1:], clip[1:], strict=True)).count

    running = best(run, repeat, prepare)
    camera.reset()
    steps = []
    for t_us, image in zip(times_us, clip, strict=True):
        start = time.process_time()
        camera.step(t_us, image)
        steps.append(time.process_time() - start)
    pixels = clip[1:].size
    return pixels / running / 1e6, 1e3 * float(np.median(steps)), events / pixels


def measure_wall(clip: np.ndarray, repeat: int) -> tuple[float, float, float]:
    """Mpixel/s of davis346 on one thread, on two, and of two cameras of one thread each at once, which is what the
    machine allows. In turn, by the clock on the wall: other programs disturb it. The clip runs forwards and backwards,
    PASSES times in all."""
    size = (clip.shape[2], clip.shape[1])
    cameras = [EventCamera("davis346", size=size, intensity="uint8", threads=threads) for threads in (1, 2, 1)]
    to_and_fro = [*clip[:-1], *clip[:0:-1]] * (PASSES // 2)
    frames = list(zip(FRAME_US * np.arange(len(to_and_fro)), to_and_fro, strict=True))
    turns = [cameras[:1], cameras[1:2], cameras[::2]]
    shortest = [np.inf] * len(turns)
    with ThreadPoolExecutor(2) as pool:
        # The first round warms up.
        for round_ in range(15 * repeat + 1):
            for number, turn in enumerate(turns):
                for camera in turn:
                    camera.reset()
                    camera.step(*frames[0])
                start = time.perf_counter()
                if len(turn) == 1:
                    turn[0].run(frames[1:])
                else:
                    list(pool.map(lambda camera: camera.run(frames[1:]), turn))
                if round_ > 0:
                    shortest[number] = min(shortest[number], time.perf_counter() - start)
    pixels = clip[0].size * (len(frames) - 1)
    one, two, both = (len(turn) * pixels / seconds / 1e6 for turn, seconds in zip(turns, shortest, strict=True))
    return one, two, both


def load_v2e(folder: Path):
    """v2e's emulator class, on one thread."""
    import torch

    torch.set_num_threads(1)
    sys.path.insert(0, str(folder))
    for name in ("screeninfo", "easygui", "tkinter", "engineering_notation", "dv_processing"):
        try:
            importlib.import_module(name)
        except ImportError:
            sys.modules[name] = MagicMock()
    logging.disable(logging.WARNING)
    return importlib.import_module("v2ecore.emulator").EventEmulator


def measure_v2e(emulator, name: str, clip: np.ndarray, times_us: np.ndarray, repeat: int) -> tuple[float, float]:
    """Mpixel/s of v2e, events per pixel and frame; clip: uint8."""
    model = PRESETS[name]
    pixels: Any = None
    events = 0

    def prepare() -> None:
        nonlocal pixels
        pixels = emulator(
            pos_thres=model.theta,
            neg_thres=model.theta,
            sigma_thres=model.sigma,
            cutoff_hz=model.cutoff_hz,
            leak_rate_hz=model.leak_rate_hz,
            shot_noise_rate_hz=model.shot_rate_hz,
            refractory_period_s=1e-6 * model.refractory_us,
            seed=1,
            device="cpu",
            output_height=clip.shape[1],
            output_width=clip.shape[2],
        )
        pixels.generate_events(clip[0], 1e-6 * times_us[0])

    def run() -> None:
        nonlocal events
        frames = zip(times_us[1:], clip[1:], strict=True)
        parts = [pixels.generate_events(image, 1e-6 * t_us) for t_us, image in frames]
        events = sum(len(part) for part in parts if part is not None)

    return clip[1:].size / best(run, repeat, prepare) / 1e6, events / clip[1:].size


def load_eventcv():
    """The package eventcv, on one thread."""
    os.environ["RAYON_NUM_THREADS"] = "1"
    try:
        return importlib.import_module("eventcv")
    except ImportError:
        sys.exit("--eventcv needs that package: pip install eventcv")


def measure_eventcv(eventcv, name: str, clip: np.ndarray, repeat: int) -> tuple[float, float]:
    """Mpixel/s of eventcv, events per pixel and frame; clip: uint8."""
    model = PRESETS[name]
    events = 0

    def run() -> None:
        nonlocal events
        stream = eventcv.simulate(
            clip,
            fps=1e6 / FRAME_US,
            pos_thres=model.theta,
            neg_thres=model.theta,
            sigma_thres=model.sigma,
            cutoff_hz=model.cutoff_hz,
            leak_rate_hz=model.leak_rate_hz,
            shot_noise_rate_hz=model.shot_rate_hz,
            refractory_us=int(model.refractory_us),
            upsample="off",
            seed=1,
        )
        events = len(stream)

    return clip[1:].size / best(run, repeat) / 1e6, events / clip[1:].size


def print_rendered(options: argparse.Namespace, emulator: Any) -> None:
    print(
        "| frames | camera | bytes | floats | events | ns an event | v2e | v2e's events | times v2e: bytes | floats |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|")
    for film in rendered_films(options.every):
        for name in options.cameras:
            speed = floats = slow = events = count = 0.0
            # By turns, since the machine's speed drifts.
            for _ in range(options.repeat):
                speed = max(speed, measure_camera(name, film.in_bytes, film.times_us, 1)[0])
                linear, _, events = measure_camera(name, film.floats, film.times_us, 1)
                floats = max(floats, linear)
                if emulator:
                    theirs, count = measure_v2e(emulator, name, film.in_bytes, film.times_us, 1)
                    slow = max(slow, theirs)
            ratios = f"{slow:.1f} | {count:.4f} | {speed / slow:.1f} | {floats / slow:.1f}" if emulator else " | | | "
            own = f"{speed:.0f} | {floats:.0f} | {events:.4f} | {1e3 / floats / events:.0f}"
            print(f"| {film.name} | {name} | {own} | {ratios} |", flush=True)


def print_kind(kind: str, options: argparse.Namespace, emulator: Any, eventcv: Any) -> None:
    print("| clip | camera | bytes | floats | step, ms | events | v2e | v2e's events | times v2e |")
    print("|---|---|---|---|---|---|---|---|---|")
    for film in kind_films(kind, options.frames):
        row, times_us, clip, in_bytes = f"| {film.name} |", film.times_us, film.floats, film.in_bytes
        for name in options.cameras:
            speed, step, events = measure_camera(name, in_bytes, times_us, options.repeat)
            floats, _, _ = measure_camera(name, clip, times_us, options.repeat)
            theirs = " | | "
            if emulator:
                slow, count = measure_v2e(emulator, name, in_bytes, times_us, min(3, options.repeat))
                theirs = f"{slow:.1f} | {count:.4f} | {speed / slow:.1f}"
            print(f"{row} {name} | {speed:.0f} | {floats:.0f} | {step:.2f} | {events:.4f} | {theirs} |", flush=True)
            if eventcv:
                slow, count = measure_eventcv(eventcv, name, in_bytes, min(3, options.repeat))
                ratio = f"{name} is {speed / slow:.1f} times as fast"
                print(f"{row} eventcv, {name} | {slow:.1f} | | | {count:.4f} | | | {ratio} |", flush=True)
        speed, _, events = measure_camera("davis346", in_bytes, times_us, options.repeat, mode="v2e")
        print(f"{row} davis346, v2e rules | {speed:.0f} | | | {events:.4f} | | | |", flush=True)
        logarithm = clip.size / best(lambda clip=clip: [np.log(image) for image in clip], options.repeat) / 1e6
        print(f"{row} numpy.log alone | | {logarithm:.0f} | | | | | |", flush=True)
        one, two, both = measure_wall(in_bytes, options.repeat)
        ratio = f"{two / one:.2f} times one; two cameras {both / one:.2f} |"
        print(f"{row} davis346, 2 threads by the clock | {two:.0f} of {one:.0f} | | | | | | {ratio}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--clip", choices=["rendered", *CLIPS], nargs="+", default=["rendered"])
    parser.add_argument("--every", type=int, nargs="+", default=[1])
    parser.add_argument("--frames", type=int, default=65)
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--cameras", choices=PRESETS, nargs="+", default=["davis346", "clean", "noisy"])
    parser.add_argument("--v2e", type=Path)
    parser.add_argument("--eventcv", action="store_true")
    options = parser.parse_args()
    emulator = load_v2e(options.v2e) if options.v2e else None
    eventcv = load_eventcv() if options.eventcv else None
    for kind in options.clip:
        if kind == "rendered":
            print_rendered(options, emulator)
        else:
            print_kind(kind, options, emulator, eventcv)
        print()
    print(f"Peak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB, frames included")


if __name__ == "__main__":
    main()
