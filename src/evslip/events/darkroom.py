"""Where films are developed, behind the camera's back if there is help."""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np

from evslip.events.film import Film
from evslip.events.stream import Events


class Darkroom:
    """Turns films into events in the order in which they come.

    expose: the raw events of a film, which comes after all films before it. arrange: of those, and whether the film has
    body masks, events. helped: expose a film in another thread while the next one is being filled, and arrange in a
    third. Leaving the context waits for them.
    """

    def __init__(
        self, expose: Callable[[Film], np.ndarray], arrange: Callable[[np.ndarray, bool], Events], helped: bool
    ):
        self._expose, self._arrange = expose, arrange
        self._helpers = ThreadPoolExecutor(2) if helped else None
        self._exposure: Future[np.ndarray] | None = None
        self._parts: list[Events | Future[Events]] = []

    def __enter__(self) -> "Darkroom":
        return self

    def __exit__(self, *_: object) -> None:
        if self._helpers is not None:
            self._helpers.shutdown()

    def wants(self, film: Film) -> bool:
        """Whether to hand in a film: when it is full, or a quarter full and the first: the helper is idle."""
        enough = film.length // 4 if self._helpers is not None and not self._parts else film.length
        return film.count >= max(enough, 1)

    def take(self, film: Film) -> Film:
        """Hand in a film. Returns one that continues where it ends: the same, or its other while this is exposed."""
        if self._helpers is None:
            self._parts.append(self._arrange(self._expose(film), film.labelled))
            return film.follow(film)
        if self._exposure is not None:
            self._exposure.result()
        exposure, labelled = self._helpers.submit(self._expose, film), film.labelled
        # An exposure begins before what waits for it, so the two helpers never both wait.
        self._parts.append(self._helpers.submit(lambda: self._arrange(exposure.result(), labelled)))
        self._exposure = exposure
        return film.other.follow(film)

    def prints(self) -> list[Events]:
        """The events of all films, in order."""
        return [part.result() if isinstance(part, Future) else part for part in self._parts]
