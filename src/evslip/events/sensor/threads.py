"""Frames processed into events, with help from other threads."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Generic, TypeVar

import numpy as np

from evslip.events.sensor.frame_buffer import FrameBuffer
from evslip.events.stream import Events

Task = Callable[[], np.ndarray]
Result = TypeVar("Result")


class _Job(Generic[Result]):
    """Work that waits for a helper, or for whoever asks for its result first."""

    def __init__(self, helpers: ThreadPoolExecutor, work: Callable[[], Result]):
        self._work = work
        self._future = helpers.submit(work)

    def result(self) -> Result:
        return self._work() if self._future.cancel() else self._future.result()


class FrameProcessor:
    """Turns buffers of frames into events in the order in which they come.

    split: of a buffer, the tasks that make its raw events, see `Sensor.tasks`. arrange: of the raw events of all tasks,
    and whether the buffer has body masks, events. threads: that work, the caller's included: the others begin on a
    buffer while it fills the next one, and it joins them then. Leaving the context waits for them.
    """

    def __init__(
        self,
        split: Callable[[FrameBuffer], list[Task]],
        arrange: Callable[[np.ndarray, bool], Events],
        threads: int,
    ):
        self._split, self._arrange = split, arrange
        self._helpers = ThreadPoolExecutor(threads - 1) if threads > 1 else None
        self._jobs: list[_Job[np.ndarray]] | None = None
        self._labelled = False
        self._parts: list[Events | _Job[Events]] = []

    def __enter__(self) -> "FrameProcessor":
        return self

    def __exit__(self, *_: object) -> None:
        if self._helpers is not None:
            self._helpers.shutdown(cancel_futures=True)

    def wants(self, buffer: FrameBuffer) -> bool:
        """Whether to hand in a buffer: when it is full, or an eighth full and the first: the helpers are idle."""
        idle = self._helpers is not None and not self._parts and self._jobs is None
        return buffer.count >= max(buffer.length // 8 if idle else buffer.length, 1)

    def process(self, buffer: FrameBuffer) -> FrameBuffer:
        """Hand in a buffer. Returns one that continues where it ends: the same, or its twin while this is processed."""
        if self._helpers is not None:
            self._finish(self._helpers)  # before the tasks are made: they may begin with what these pixels are now
        tasks = self._split(buffer) if buffer.count > 0 else []
        if self._helpers is None:
            self._parts.append(self._arrange(_join([task() for task in tasks]), buffer.labelled))
            return buffer.follow(buffer)
        self._jobs, self._labelled = [_Job(self._helpers, task) for task in tasks], buffer.labelled
        return buffer.twin.follow(buffer)

    def events(self) -> list[Events]:
        """Events of all buffers, in order."""
        if self._helpers is not None:
            self._finish(self._helpers)
        return [part.result() if isinstance(part, _Job) else part for part in self._parts]

    def _finish(self, helpers: ThreadPoolExecutor) -> None:
        """Wait for the buffer in work, and take part in it: from its end, as helpers begin at its beginning."""
        if self._jobs is not None:
            raw = _join([job.result() for job in reversed(self._jobs)][::-1])
            self._parts.append(_Job(helpers, partial(self._arrange, raw, self._labelled)))
        self._jobs = None


def _join(raw: list[np.ndarray]) -> np.ndarray:
    return raw[0] if len(raw) == 1 else np.concatenate([np.empty((0, 2), np.int64), *raw])
