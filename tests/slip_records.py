"""Records whose truth is known by construction: points of texture that stand still while held and move while slipping."""

import numpy as np

from evslip.events.stream import Events
from evslip.frame import BACKGROUND, OBJECT
from evslip.record import Record
from evslip.truth import Truth
from evslip.window_set import Windows, WindowSettings
from evslip.windows import windows_of

SIZE = (346, 260)
STEPS = 1500
HELD = slice(200, 1300)


def turning(angle_deg: np.ndarray, axis: tuple[float, float, float] = (0.0, 1.0, 0.0)) -> np.ndarray:
    """Quaternions wxyz of rotations about a unit axis, of shape (n, 4)."""
    half = np.radians(angle_deg) / 2
    return np.column_stack([np.cos(half), np.sin(half)[:, None] * np.array(axis)])


def truth_of(angle_deg: np.ndarray, slide_mm: np.ndarray | None = None, held: slice = HELD) -> Truth:
    """The truth of an object that has turned by `angle_deg` and slid by `slide_mm` at every millisecond."""
    n = len(angle_deg)
    slide = np.zeros(n) if slide_mm is None else slide_mm
    position = np.column_stack([np.zeros(n), np.zeros(n), 0.1 + slide / 1e3])
    flags = np.zeros(n, bool)
    flags[held] = True
    moving = (np.abs(angle_deg) > 0.1) | (np.abs(slide) > 0.1)
    onset = 1000 * int(moving.argmax()) if moving.any() else None
    rotation = turning(angle_deg)
    return Truth(np.arange(n) * 1000, np.abs(angle_deg), rotation, position, flags, (0, 1000 * (n - 1)), onset)


def stream(rng: np.random.Generator, moving: np.ndarray, noise: int = 3000, points: int = 60) -> Events:
    """Uniform noise on the background; while `moving` (per ms), points of the object cross the image at 300 px/s."""
    n = len(moving)
    noise_ms = rng.integers(0, n, noise)
    ms = np.repeat(np.flatnonzero(moving), points // 2)
    which = rng.integers(0, points, len(ms))
    start = rng.uniform([80, 20], [260, 250], (points, 2))
    t_ms = np.concatenate([noise_ms, ms])
    x = np.concatenate([rng.uniform(0, SIZE[0], noise), start[which, 0] + 0.3 * (ms % 160) - 24])
    y = np.concatenate([rng.uniform(0, SIZE[1], noise), start[which, 1]])
    body = np.repeat([BACKGROUND, OBJECT], [noise, len(ms)])
    t_us = t_ms * 1000 + rng.integers(0, 1000, len(t_ms))
    order = np.argsort(t_us, kind="stable")
    columns = t_us, x.clip(0, SIZE[0] - 1).astype(np.uint16), y.astype(np.uint16), rng.random(len(x)) < 0.5
    return Events(*(column[order] for column in columns), body=body[order].astype(np.uint8))


def slip_record(index: int, slips: bool, split: str = "train") -> Record:
    """1.5 s, held from .2 to 1.3 s; a slipping one turns at 30 deg/s from .6 s on."""
    rng = np.random.default_rng([index, len(split)])
    angle = 30.0 * np.clip(np.arange(STEPS) / 1e3 - 0.6, 0, None) * slips
    events = stream(rng, np.diff(angle, prepend=0.0) > 0)
    return Record(
        kind="simulated", name=f"{split}/{index:07d}", size=SIZE, events=events, split=split, index=index,
        truth=truth_of(angle),
    )  # fmt: skip


def slip_windows(count: int = 8, split: str = "train", **settings: object) -> Windows:
    """Windows of `count` records, every second one slipping."""
    records = [slip_record(index, index % 2 == 0, split) for index in range(count)]
    return windows_of(records, WindowSettings(**{"hop_s": 0.08, **settings}))  # type: ignore[arg-type]
