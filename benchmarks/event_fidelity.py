"""How far the events of the fast renderer are from those of a converged one: python benchmarks/event_fidelity.py

A piece of a random sample, around its slip's onset and in the middle of its transport, is filmed three times: "fast" is
what `evslip generate` does, at adaptive frame times; "dense" draws the same pixels at 10 kHz; "truth" draws four times
as many columns and rows at 10 kHz, whose mean over 4 x 4 is then blurred as the lens does. All go through the same
noiseless pixels. Fast against dense is the error of time, dense against truth that of space.

Errors, of events n against true events m; N is the number of true events in all pieces:
    total   |sum of n - sum of m| / N
    pixels  sum of |n - m| / N over cells of one pixel, one polarity and a whole piece
    8x8     the same over cells of 8 x 8 pixels, one polarity and one millisecond
    bins    the same over cells of one polarity and one millisecond of the whole image
"""

import argparse
import time
from collections.abc import Iterator

import numpy as np

from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.events import EventCamera, Events, concatenate
from evslip.physics.motion.phases import phase_times
from evslip.physics.simulation import simulate
from evslip.physics.trajectory import Trajectory
from evslip.physics.truth import measure
from evslip.rendering import render
from evslip.rendering.camera import hand_camera
from evslip.rendering.lens import SPREAD, expose
from evslip.rendering.raycast import renderer
from evslip.utils.errors import EvslipError

FINE = 4
STEP_US = 100
BIN_US = 1000
CAMERAS = ("davis346", "clean")
Image = tuple[int, np.ndarray]


def pieces(traj: Trajectory, window_us: int) -> dict[str, tuple[int, int]]:
    """Start and end in microseconds of what is looked at."""
    truth = measure(traj)
    start, end = phase_times(traj.params).get("move", truth.span_us)
    middles = {"transport": (start + end) // 2}
    if truth.onset_us is not None:
        middles["onset"] = truth.onset_us
    first, last = truth.span_us
    starts = {name: min(max(middle - window_us // 2, first), last - window_us) for name, middle in middles.items()}
    return {name: (start, start + window_us) for name, start in starts.items()}


def fast(traj: Trajectory, start_us: int, end_us: int) -> Iterator[Image]:
    for frame in render(traj, start_us=start_us, end_us=end_us):
        yield frame.t_us, frame.luminance


def dense(traj: Trajectory, times_us: np.ndarray) -> Iterator[Image]:
    for frame in render(traj, times_us=times_us):
        yield frame.t_us, frame.luminance


def converged(traj: Trajectory, times_us: np.ndarray) -> Iterator[Image]:
    """The mean of FINE x FINE finer pixels, blurred by the same lens as the fast renderer's pixels."""
    camera = hand_camera(traj.params)
    scratch = np.empty((camera.height, camera.width), np.float32)
    renderer.SPREAD = np.float32(0)
    try:
        for frame in render(traj, times_us=times_us, size=(camera.width * FINE, camera.height * FINE)):
            luminance = frame.luminance.reshape(camera.height, FINE, camera.width, FINE).mean((1, 3))
            spread = np.empty_like(luminance)
            expose(luminance, np.float32(1), SPREAD, scratch, spread)
            yield frame.t_us, spread
    finally:
        renderer.SPREAD = SPREAD


def filmed(frames: Iterator[Image], size: tuple[int, int]) -> tuple[list[Events], int]:
    """The events of every camera, and the number of frames."""
    cameras = [EventCamera(name, size=size, leak_rate_hz=0.0, shot_rate_hz=0.0) for name in CAMERAS]
    parts: list[list[Events]] = [[] for _ in cameras]
    count = 0
    for t_us, image in frames:
        for camera, part in zip(cameras, parts, strict=True):
            part.append(camera.step(t_us, image))
        count += 1
    return [concatenate(part) for part in parts], count


def differences(events: Events, truth: Events) -> np.ndarray:
    """Sums of |difference| for the four errors."""
    total = abs(events.count - truth.count)
    pixels, blocks, bins = ((1, 10**9), (8, BIN_US), (10**5, BIN_US))
    return np.array([total, *(_difference(events, truth, *cell) for cell in (pixels, blocks, bins))])


def _difference(events: Events, truth: Events, pixels: int, time_us: int) -> int:
    cells = []
    for stream in (events, truth):
        p, y, x, t_us = (a.astype(np.int64) for a in (stream.p, stream.y, stream.x, stream.t_us))
        cells.append(np.ravel_multi_index((p, y // pixels, x // pixels, t_us // time_us), (2, 4096, 4096, 10**6)))
    _, place = np.unique(np.concatenate(cells), return_inverse=True)
    sign = np.repeat([1, -1], [len(cell) for cell in cells])
    return int(np.abs(np.bincount(place, sign)).sum())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--preset", default="complex")
    parser.add_argument("--count", type=int, default=8, help="samples")
    parser.add_argument("--first", type=int, default=0, help="index of the first")
    parser.add_argument("--window", type=float, default=0.3, help="length of a piece in seconds")
    parser.add_argument("--every", type=int, default=1, help="take every Nth frame of 10 kHz")
    options = parser.parse_args()
    print("| sample | piece | frames | camera | events | total, pixels, 8x8, bins: fast | dense | fast to dense |")
    print("|---|---|---|---|---|---|---|---|")
    sums, spent = np.zeros((len(CAMERAS), 3, 4)), time.process_time()
    counts = np.zeros(len(CAMERAS))
    for index in range(options.first, options.first + options.count):
        try:
            traj = simulate(draw(load_config(options.preset), index))
        except EvslipError:
            continue  # a grasp that fails has no events
        size = (hand_camera(traj.params).width, hand_camera(traj.params).height)
        for name, (start, end) in pieces(traj, round(1e6 * options.window)).items():
            times = np.arange(start, end + 1, STEP_US * options.every)
            truth, _ = filmed(converged(traj, times), size)
            close, _ = filmed(dense(traj, times), size)
            quick, frames = filmed(fast(traj, start, int(times[-1])), size)
            for k, camera in enumerate(CAMERAS):
                found = [
                    differences(quick[k], truth[k]),
                    differences(close[k], truth[k]),
                    differences(quick[k], close[k]),
                ]
                sums[k] += found
                counts[k] += truth[k].count
                row = " | ".join(_tell(part / max(1, truth[k].count)) for part in found)
                print(f"| {index} | {name} | {frames} | {camera} | {truth[k].count} | {row} |", flush=True)
    for k, camera in enumerate(CAMERAS):
        row = " | ".join(_tell(part / max(1.0, counts[k])) for part in sums[k])
        print(f"| all | | | {camera} | {counts[k]:.0f} | {row} |")
    print(f"{time.process_time() - spent:.0f} CPU-s")


def _tell(shares: np.ndarray) -> str:
    return ", ".join(f"{share:.3f}" for share in shares)


if __name__ == "__main__":
    main()
