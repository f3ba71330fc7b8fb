"""Records of known truth: points of texture that stand still while held and move while slipping."""

import numpy as np

from evslip.data.record import Record
from evslip.events.frame import BACKGROUND, OBJECT
from evslip.events.stream import Events
from evslip.physics.truth import Truth
from evslip.windows.cutting import windows_of
from evslip.windows.window_set import Windows, WindowSettings

SIZE = (346, 260)
STEPS = 2400
"""Milliseconds that a record lasts."""
HELD = slice(100, 2300)


def turning(begin_ms: int, end_ms: int, degrees: float) -> np.ndarray:
    """Angle at every millisecond of an object that turns evenly by `degrees` between two times, of shape (STEPS,)."""
    return degrees * np.clip((np.arange(STEPS) - begin_ms) / (end_ms - begin_ms), 0, 1)


def truth_of(angle_deg: np.ndarray, slide_mm: np.ndarray | None = None, held: slice = HELD) -> Truth:
    """The truth of an object that has turned by `angle_deg` and slid by `slide_mm` at every millisecond."""
    n = len(angle_deg)
    slide = np.zeros(n) if slide_mm is None else slide_mm
    flags = np.zeros(n, bool)
    flags[held] = True
    half = np.radians(angle_deg) / 2
    rotation = np.column_stack([np.cos(half), np.zeros(n), np.sin(half), np.zeros(n)])
    position = np.column_stack([np.zeros(n), np.zeros(n), 0.1 + slide / 1e3])
    moved = (np.abs(angle_deg) > 0.1) | (np.abs(slide) > 0.1)
    onset_us = 1000 * int(moved.argmax()) if moved.any() else None
    return Truth(np.arange(n) * 1000, np.abs(angle_deg), rotation, position, flags, (0, 1000 * (n - 1)), onset_us)


def stream(rng: np.random.Generator, moving: np.ndarray, noise: int = 5000, points: int = 60) -> Events:
    """Uniform noise on the background; while `moving` (per ms), points of the object cross the image at 300 px/s."""
    ms = np.repeat(np.flatnonzero(moving), points // 2)
    which = rng.integers(0, points, len(ms))
    start = rng.uniform([100, 20], [240, 250], (points, 2))
    t_ms = np.concatenate([rng.integers(0, len(moving), noise), ms])
    x = np.concatenate([rng.uniform(0, SIZE[0], noise), start[which, 0] + 0.3 * (ms % 160 - 80)])
    y = np.concatenate([rng.uniform(0, SIZE[1], noise), start[which, 1]])
    body = np.repeat(np.array([BACKGROUND, OBJECT], np.uint8), [noise, len(ms)])
    t_us = t_ms * 1000 + rng.integers(0, 1000, len(t_ms))
    order = np.argsort(t_us, kind="stable")
    columns = (t_us, x.astype(np.uint16), y.astype(np.uint16), rng.random(len(x)) < 0.5)
    return Events(*(column[order] for column in columns), body=body[order])


def slip_record(name: str, angle_deg: np.ndarray, seed: int = 0) -> Record:
    """A record of an object that has turned by `angle_deg` in the hand at every millisecond."""
    events = stream(np.random.default_rng(seed), np.abs(np.diff(angle_deg, prepend=0.0)) > 0)
    return Record(kind="simulated", name=name, size=SIZE, events=events, split="train", truth=truth_of(angle_deg))


def slip_records(count: int) -> list[Record]:
    """Every second one slips, at times and speeds that differ."""
    return [
        slip_record(f"train/{i:07d}", turning(500 + 50 * i, 1500 + 50 * i, 12.0 * (i % 2)), seed=i)
        for i in range(count)
    ]


def slip_windows(count: int = 8, **settings: object) -> Windows:
    """Windows of so many records."""
    return windows_of(slip_records(count), WindowSettings(**settings))  # type: ignore[arg-type]
