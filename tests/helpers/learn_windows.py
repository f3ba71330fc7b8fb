"""Windows of random events, for tests of networks."""

import numpy as np

from evslip.windows.window_events import WindowEvents

LENGTH_US = 160_000


def random_window(seed: int, count: int, width: int = 200, height: int = 250) -> WindowEvents:
    """Clustered in space and time, so that several events share a pixel and a bin."""
    rng = np.random.default_rng(seed)
    t_us = np.sort(rng.choice(rng.integers(0, LENGTH_US, max(1, count // 3)), count)).astype(np.uint32)
    x, y = (np.minimum(rng.beta(0.7, 0.7, count) * n, n - 1).astype(np.uint8) for n in (width, height))
    return WindowEvents(t_us, x, y, rng.random(count) < 0.5)
