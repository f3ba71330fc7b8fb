"""A record of two cameras made of random numbers."""

from dataclasses import replace

import numpy as np

from evslip.config.loading import load_config
from evslip.data.record import Record, Stream
from evslip.draws.draw import draw
from evslip.events.stream import empty_events
from sample_records import random_events, simulated

KEYS = {"camera.width": 40, "camera.height": 30, "camera.left.mount": "finger", "camera.right.mount": "front"}
CONFIG = load_config("demo", KEYS | {"camera.right.width": 48})


def seen_by_two(index: int = 0) -> Record:
    """The numbers of `simulated`; the right camera is the wider one and trembles."""
    one, params = simulated(index), draw(CONFIG, index)
    assert one.trajectory is not None
    rng, moved = np.random.default_rng([index, 2]), np.ones((len(one.trajectory.t_us), 7), np.float32)
    left = Stream((40, 30), random_events(rng, 100), {"frames": 7})
    right = Stream((48, 30), random_events(rng, 150, (48, 30)), {"frames": 9}, moved)
    return replace(
        one,
        params=params,
        trajectory=one.trajectory._replace(params=params),
        events=empty_events(),
        streams={"left": left, "right": right},
        stats={},
    )
