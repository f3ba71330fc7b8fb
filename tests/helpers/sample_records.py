"""Small records made of random numbers, for tests of the files they are kept in."""

import numpy as np

from evslip.config.loading import load_config
from evslip.config.params import Params
from evslip.data.record import Record
from evslip.draws.draw import draw
from evslip.events.stream import FIELDS, Events
from evslip.physics.episodes import Episode
from evslip.physics.motion.phases import PHASE_NAMES
from evslip.physics.trajectory import Trajectory
from evslip.physics.truth import Truth

CONFIG = load_config("demo", {"camera.width": 40, "camera.height": 30})


def random_events(
    rng: np.random.Generator, count: int, size: tuple[int, int] = (40, 30), labelled: bool = True
) -> Events:
    """A valid stream of `count` events within 50 ms."""
    return Events(
        np.sort(rng.integers(0, 50_000, count)).astype(np.int64),
        rng.integers(0, size[0], count).astype(np.uint16),
        rng.integers(0, size[1], count).astype(np.uint16),
        rng.random(count) < 0.5,
        rng.choice(np.array([0, 1, 2, 3, 255], np.uint8), count) if labelled else None,
        rng.integers(0, 4, count).astype(np.uint8) if labelled else None,
    )


def random_motion(rng: np.random.Generator, params: Params, steps: int, slips: bool) -> tuple[Trajectory, Truth]:
    """A trajectory and a truth of the right shapes; the numbers mean nothing."""
    t_us = np.arange(steps, dtype=np.int64) * 1000
    tails = ((7,), (7,), (9,), (2,), (), (2, 3), (2,))
    trajectory = Trajectory(params, t_us, *(rng.normal(size=(steps, *tail)) for tail in tails))
    truth = Truth(
        t_us,
        rng.random(steps),
        rng.normal(size=(steps, 4)),
        rng.normal(size=(steps, 3)),
        rng.random(steps) < 0.5,
        (0, 1000 * steps),
        1000 if slips else None,
        (Episode(1000, 3000, "mixed", "tilt", rng.random(), rng.random()),) if slips else (),
        rng.integers(0, len(PHASE_NAMES), steps).astype(np.uint8),
        trajectory.pad_force_n,
        trajectory.pad_friction,
        trajectory.pad_utilisation,
    )
    return trajectory, truth


def simulated(index: int = 0, split: str = "train", events: int = 200, steps: int = 5) -> Record:
    """Every third one slips."""
    rng = np.random.default_rng([index, len(split)])
    params = draw(CONFIG, index, split)
    trajectory, truth = random_motion(rng, params, steps, slips=index % 3 == 0)
    return Record(
        kind="simulated",
        name=f"{split}/{index:07d}",
        size=(40, 30),
        events=random_events(rng, events),
        split=split,
        index=index,
        params=params,
        trajectory=trajectory,
        truth=truth,
        stats={"frames": 7},
        provenance={"evslip": "0.1.0"},
    )


def assert_equal(one: object, other: object) -> None:
    """Equality that looks into arrays and tuples, dtypes included."""
    assert type(one) is type(other)
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        assert one.dtype == other.dtype
        np.testing.assert_array_equal(one, other)
    elif isinstance(one, Record) and isinstance(other, Record):
        for name in Record.__dataclass_fields__:
            assert_equal(getattr(one, name), getattr(other, name))
    elif isinstance(one, Events) and isinstance(other, Events):
        for name in FIELDS:
            assert_equal(getattr(one, name), getattr(other, name))
    elif isinstance(one, tuple) and isinstance(other, tuple):
        assert len(one) == len(other)
        for a, b in zip(one, other, strict=True):
            assert_equal(a, b)
    else:
        assert one == other
