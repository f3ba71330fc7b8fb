"""What a slow video costs, and when it helps to interpolate: python benchmarks/interpolation.py [--feature PIXELS]

A disc with texture of `feature` pixels glides over a still ground of about twice that, filmed at 60 Hz, with 1 to 16
pixels of motion from frame to frame. The events of each way to fill the gaps (`evslip events --interpolate`) are
compared with those of the same scene rendered 32 times as often, by the same noiseless camera. Error: sum of
|difference| of event counts over the sum of the reference's, per polarity, in cells of one pixel and the whole clip
("where"), and of 8 x 8 pixels and a quarter of a frame's time ("where and when"). Without the extras flow and rife
their rows are left out.
"""

import argparse
import time
from collections.abc import Iterable

import numpy as np
from scipy.ndimage import gaussian_filter

from evslip.codecs.clips import flow, rife
from evslip.codecs.clips.sources import TimedImage, held
from evslip.events import EventCamera, Events
from evslip.utils.errors import MissingExtraError

SIZE = (160, 128)
FPS, DENSE = 60, 32
MOTIONS = (1, 2, 4, 8, 16)


def texture(seed: int, pixels: float) -> np.ndarray:
    """Smooth luminance of 0.04 to 0.9, float64 of shape (256, 512), with features about `pixels` wide."""
    noise = gaussian_filter(np.random.default_rng(seed).normal(size=(256, 512)), pixels / 2, mode="wrap")
    return np.exp(np.interp(noise, np.quantile(noise, (0.02, 0.98)), np.log((0.04, 0.9))))


def scene(shift: float, disc: np.ndarray, ground: np.ndarray) -> np.ndarray:
    """Luminance with the disc moved by `shift` pixels, float32 of (height, width); its rim is a pixel wide."""
    width, height = SIZE
    y, x = np.mgrid[0:height, 0:width]
    u = x - shift
    left = np.floor(u).astype(int)
    share = u - left
    cover = np.clip(0.3 * height + 0.5 - np.hypot(u - 0.32 * width, y - 0.5 * height), 0, 1)
    seen = disc[y, left % 512] * (1 - share) + disc[y, (left + 1) % 512] * share
    return (ground[y, x] * (1 - cover) + seen * cover).astype(np.float32)


def clip(frames: int, motion: float, times: int, feature: float) -> list[TimedImage]:
    """So many frames of the slow video, rendered `times` as often."""
    count = (frames - 1) * times + 1
    disc, ground = texture(1, feature), texture(2, 1.8 * feature)
    return [(1e6 * n / times / FPS, scene(motion * n / times, disc, ground), None) for n in range(count)]


def events_of(frames: Iterable[TimedImage]) -> Events:
    return EventCamera("clean", size=SIZE, sigma=0.0).run(frames)


def errors(events: Events, truth: Events) -> tuple[float, float]:
    """ "where" and "where and when"."""
    return _error(events, truth, 1, 1e12), _error(events, truth, 8, 0.25e6 / FPS)


def _error(events: Events, truth: Events, pixels: int, time_us: float) -> float:
    counts = []
    for stream in (events, truth):
        cell = np.stack([stream.x // pixels, stream.y // pixels, stream.p, stream.t_us // time_us]).astype(np.int64)
        counts.append(np.ravel_multi_index(tuple(cell), (512, 512, 2, 10_000)))
    cells, place = np.unique(np.concatenate(counts), return_inverse=True)
    sign = np.repeat([1, -1], [len(c) for c in counts])
    return float(np.abs(np.bincount(place, sign, len(cells))).sum() / truth.count)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=5)
    parser.add_argument("--upsample", type=int, default=8)
    parser.add_argument("--feature", type=float, default=5.0)
    parser.add_argument("--motions", type=float, nargs="+", default=MOTIONS)
    options = parser.parse_args()
    print("| pixels a frame | way | events | error, where | error, where and when | s a frame |")
    print("|---|---|---|---|---|---|")
    for motion in options.motions:
        slow = clip(options.frames, motion, 1, options.feature)
        truth = events_of(clip(options.frames, motion, DENSE, options.feature))
        print(f"| {motion:g} | rendered at {FPS * DENSE} Hz | {truth.count} | 0 | 0 | |", flush=True)
        ways = {
            "none": lambda slow=slow: held(slow),
            "linear": lambda slow=slow: slow,
            f"flow, {options.upsample}": lambda slow=slow: flow.smoothed(slow, options.upsample, "linear"),
            f"rife, {options.upsample}": lambda slow=slow: rife.smoothed(slow, options.upsample, "linear"),
            f"rendered at {FPS * options.upsample} Hz": lambda motion=motion: clip(
                options.frames, motion, options.upsample, options.feature
            ),
        }
        for name, frames in ways.items():
            start = time.perf_counter()
            try:
                events = events_of(frames())
            except MissingExtraError:
                continue
            seconds = (time.perf_counter() - start) / (options.frames - 1)
            where, when = errors(events, truth)
            print(f"| {motion:g} | {name} | {events.count} | {where:.3f} | {when:.3f} | {seconds:.2f} |", flush=True)


if __name__ == "__main__":
    main()
