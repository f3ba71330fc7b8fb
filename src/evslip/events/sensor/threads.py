"""Where films are developed, with help from other threads."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Generic, TypeVar

import numpy as np

from evslip.events.sensor.frame_buffer import Film
from evslip.events.stream import Events

Exposure = Callable[[], np.ndarray]
Result = TypeVar("Result")


class _Job(Generic[Result]):
    """Work that waits for a helper, or for whoever asks for its result first."""

    def __init__(self, helpers: ThreadPoolExecutor, work: Callable[[], Result]):
        self._work = work
        self._future = helpers.submit(work)

    def result(self) -> Result:
        return self._work() if self._future.cancel() else self._future.result()


class Darkroom:
    """Turns films into events in the order in which they come.

    expose: how to expose a film, which comes after all films before it: pieces of work that can be done in any order
    and at the same time, each of which gives raw events. arrange: of those of all pieces, and whether the film has body
    masks, events. threads: that work, the caller's included: the others begin on a film while it fills the next one,
    and it joins them then. Leaving the context waits for them.
    """

    def __init__(
        self,
        expose: Callable[[Film], list[Exposure]],
        arrange: Callable[[np.ndarray, bool], Events],
        threads: int,
    ):
        self._expose, self._arrange = expose, arrange
        self._helpers = ThreadPoolExecutor(threads - 1) if threads > 1 else None
        self._jobs: list[_Job[np.ndarray]] | None = None
        self._labelled = False
        self._parts: list[Events | _Job[Events]] = []

    def __enter__(self) -> "Darkroom":
        return self

    def __exit__(self, *_: object) -> None:
        if self._helpers is not None:
            self._helpers.shutdown(cancel_futures=True)

    def wants(self, film: Film) -> bool:
        """Whether to hand in a film: when it is full, or an eighth full and the first: the helpers are idle."""
        idle = self._helpers is not None and not self._parts and self._jobs is None
        return film.count >= max(film.length // 8 if idle else film.length, 1)

    def take(self, film: Film) -> Film:
        """Hand in a film. Returns one that continues where it ends: the same, or its other while this is exposed."""
        if self._helpers is None:
            self._parts.append(self._arrange(join([piece() for piece in self._expose(film)]), film.labelled))
            return film.follow(film)
        self._finish(self._helpers)
        self._jobs, self._labelled = [_Job(self._helpers, piece) for piece in self._expose(film)], film.labelled
        return film.other.follow(film)

    def prints(self) -> list[Events]:
        """The events of all films, in order."""
        if self._helpers is not None:
            self._finish(self._helpers)
        return [part.result() if isinstance(part, _Job) else part for part in self._parts]

    def _finish(self, helpers: ThreadPoolExecutor) -> None:
        """Wait for the film in work, and take part in it: from its end, as helpers begin at its beginning."""
        if self._jobs is not None:
            raw = join([job.result() for job in reversed(self._jobs)][::-1])
            self._parts.append(_Job(helpers, partial(self._arrange, raw, self._labelled)))
        self._jobs = None


def join(raw: list[np.ndarray]) -> np.ndarray:
    """Raw events of all pieces of a film."""
    return raw[0] if len(raw) == 1 else np.concatenate([np.empty((0, 2), np.int64), *raw])
