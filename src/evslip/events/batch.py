"""Many event cameras side by side, for parallel simulations."""

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from evslip.events.camera import EventCamera, require_whole
from evslip.events.stream import Events
from evslip.utils.errors import DataError


class EventCameras:
    """Independent cameras of one kind, each with its own mismatch and noise.

    count: how many. seed: camera i has the seed `camera_seed(seed, i)`. threads: cameras are shared among so many
    threads. Everything else is as in EventCamera.
    """

    def __init__(self, count: int, preset: str = "davis346", *, seed: int = 0, threads: int = 1, **arguments: Any):
        for name, value, low in (("count", count, 1), ("threads", threads, 1), ("seed", seed, 0)):
            require_whole(name, value, low)
        self.cameras = [EventCamera(preset, seed=camera_seed(seed, i), **arguments) for i in range(count)]
        self._threads = min(threads, count)

    def step(self, t_us: float | np.ndarray, images: np.ndarray, bodies: np.ndarray | None = None) -> list[Events]:
        """Each camera's events since its frame before.

        t_us: one time, or one for each camera; images: (count, height, width); bodies: uint8 of that shape. Raises
        DataError; where one camera's input is wrong others may have taken theirs.
        """
        count = len(self.cameras)
        if np.ndim(t_us) not in (0, 1) or (np.ndim(t_us) == 1 and len(np.asarray(t_us)) != count):
            raise DataError(f"frame times: shape {np.shape(t_us)} given, expected one time or {count}")
        for name, arrays in (("images", images), ("bodies", bodies)):
            if arrays is not None and len(arrays) != count:
                raise DataError(f"{name}: {len(arrays)} given for {count} cameras")
        times_us = np.broadcast_to(np.asarray(t_us, object), count)
        masks = [None] * count if bodies is None else bodies
        with ThreadPoolExecutor(self._threads) as pool:
            return list(pool.map(EventCamera.step, self.cameras, times_us, images, masks))

    def reset(self, which: np.ndarray | None = None) -> None:
        """Forget all frames, of all cameras or of those that an index array or a mask picks."""
        for index in np.arange(len(self.cameras))[slice(None) if which is None else which]:
            self.cameras[index].reset()


def camera_seed(seed: int, index: int) -> int:
    """Seed of one camera of a batch."""
    return int(np.random.SeedSequence([seed, index]).generate_state(1, np.uint64)[0])
