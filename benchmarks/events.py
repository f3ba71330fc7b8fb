"""Speed of the event camera, one thread: python benchmarks/events.py [--frames N] [--repeat N]

A textured square turns at 2 revolutions a second before a gradient, filmed at 2000 frames a second. Every figure is the
best of some runs. "events" counts them per pixel and frame: each costs about as much as forty quiet pixels.
"""

import argparse
import resource
import time
from collections.abc import Callable

import numpy as np

from evslip.events import PRESETS, EventCamera

SIZES = ((346, 260), (640, 480), (1280, 720))
FRAME_US = 500.0


def make_clip(size: tuple[int, int], frames: int) -> np.ndarray:
    """Linear luminance, float32 of shape (frames, height, width)."""
    width, height = size
    rng = np.random.default_rng(1)
    texture = rng.uniform(0.02, 0.95, (14, 14))
    rows, columns = np.mgrid[0:height, 0:width] - np.array([height, width])[:, None, None] / 2
    ground = np.broadcast_to(np.linspace(0.03, 0.7, width), (height, width))
    half = 0.35 * min(size)
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


def best(work: Callable[[], object], repeat: int) -> float:
    """Shortest time of some calls, in seconds."""
    times = []
    for _ in range(repeat):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def measure(name: str, clip: np.ndarray, times_us: np.ndarray, repeat: int, **arguments) -> tuple[float, float, float]:
    """Mpixel/s of `run`, milliseconds a `step`, events per pixel and frame."""
    size = (clip.shape[2], clip.shape[1])
    camera = EventCamera(name, size=size, **arguments)
    camera.run(zip(times_us[:3], clip, strict=False))
    events = 0

    def run() -> None:
        nonlocal events
        camera.reset()
        events = camera.run(zip(times_us, clip, strict=True)).count

    running = best(run, repeat)
    camera.reset()
    steps = []
    for t_us, image in zip(times_us, clip, strict=True):
        start = time.perf_counter()
        camera.step(t_us, image)
        steps.append(time.perf_counter() - start)
    pixels = clip[1:].size
    return pixels / running / 1e6, 1e3 * float(np.median(steps)), events / pixels


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=65)
    parser.add_argument("--repeat", type=int, default=5)
    options = parser.parse_args()
    print("| size | camera | Mpixel/s | step, ms | events |\n|---|---|---|---|---|")
    for size in SIZES:
        clip = make_clip(size, options.frames)
        times_us = FRAME_US * np.arange(len(clip))
        label = f"{size[0]}x{size[1]}"
        for name in PRESETS:
            speed, step, events = measure(name, clip, times_us, options.repeat)
            print(f"| {label} | {name} | {speed:.0f} | {step:.2f} | {events:.4f} |")
        speed, step, events = measure("davis346", clip, times_us, options.repeat, threads=2)
        print(f"| {label} | davis346, 2 threads | {speed:.0f} | {step:.2f} | {events:.4f} |")
        in_bytes = (255 * np.clip(clip, 0, 1)).astype(np.uint8)
        speed, step, events = measure("davis346", in_bytes, times_us, options.repeat, intensity="uint8")
        print(f"| {label} | davis346, uint8 | {speed:.0f} | {step:.2f} | {events:.4f} |")
        speed, step, events = measure("davis346", in_bytes, times_us, options.repeat, intensity="uint8", mode="v2e")
        print(f"| {label} | davis346, v2e rules | {speed:.0f} | {step:.2f} | {events:.4f} |")
        logarithm = clip.size / best(lambda clip=clip: [np.log(image) for image in clip], options.repeat) / 1e6
        print(f"| {label} | numpy.log alone | {logarithm:.0f} | | |", flush=True)
    print(f"\nPeak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB, clips included")


if __name__ == "__main__":
    main()
