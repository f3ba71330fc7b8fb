"""Where films are developed, behind the camera's back if there is a helper."""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor

from evslip.events.film import Film
from evslip.events.stream import Events


class Darkroom:
    """Turns films into events in the order in which they come.

    develop: the events of a film. helper: develop a film in another thread, while the next one is being filled. Leaving
    the context waits for it.
    """

    def __init__(self, develop: Callable[[Film], Events], helper: bool):
        self._develop = develop
        self._helper = ThreadPoolExecutor(1) if helper else None
        self._parts: list[Events | Future[Events]] = []

    def __enter__(self) -> "Darkroom":
        return self

    def __exit__(self, *_: object) -> None:
        if self._helper is not None:
            self._helper.shutdown()

    def wants(self, film: Film) -> bool:
        """Whether to hand in a film: when it is full, or a quarter full and the first: the helper is idle."""
        enough = film.length // 4 if self._helper is not None and not self._parts else film.length
        return film.count >= max(enough, 1)

    def take(self, film: Film) -> Film:
        """Hand in a film. Returns one that continues where it ends: the same, or its other while this is developed."""
        if self._helper is None:
            self._parts.append(self._develop(film))
            return film.follow(film)
        self._wait()
        self._parts.append(self._helper.submit(self._develop, film))
        return film.other.follow(film)

    def prints(self) -> list[Events]:
        """The events of all films, in order."""
        self._wait()
        return [part for part in self._parts if not isinstance(part, Future)]

    def _wait(self) -> None:
        if self._parts and isinstance(self._parts[-1], Future):
            self._parts[-1] = self._parts[-1].result()
