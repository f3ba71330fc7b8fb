"""Progress of long work: steps, drawn as bars at a terminal, written as lines every few seconds where there is none."""

import contextlib
import os
import sys
import threading
import time
from collections.abc import Iterable, Iterator, Sized
from datetime import datetime, timedelta
from typing import Any, Self, TypeVar

from evslip.utils.errors import ConfigError

Item = TypeVar("Item")
EVERY_S = 9.0
"""Time between two lines: on a busy machine, too, there is one every 10 s."""
VARIABLE = "EVSLIP_PROGRESS_S"
"""Environment variable with another time, in seconds."""
BAR_AFTER_S = 0.5
"""Work that ends sooner draws no bar."""
DRAWN_EVERY_S = 0.1
SPEED_OVER_S = 600.0
"""The time left on a bar is judged by the speed over so many seconds: samples differ in cost."""


class Step:
    """A part of the work, under way while its block runs. Call it with how much more is done.

    Steps may lie within one another. They are shown only where `shown` is on, and cost next to nothing elsewhere.
    """

    def __init__(self, title: str, total: float | None = None):
        self.title, self.total = title, total
        self.done, self.note = 0, ""
        self._before, self._since = 0, time.monotonic()

    def __enter__(self) -> Self:
        _STEPS.append(self)
        return self

    def __exit__(self, *_: object) -> None:
        _STEPS.remove(self)

    def __call__(self, count: int = 1) -> None:
        self.done += count

    def begin(self, total: float, done: int) -> None:
        """The work begins now, with a part of it done before."""
        self.total, self.done, self._before, self._since = total, done, done, time.monotonic()

    def line(self) -> str:
        """Figures so far, as far as there are any."""
        passed = time.monotonic() - self._since
        figures = []
        if self.total:
            figures = [f"{self.done:,} of {self.total:,} ({self.done / self.total:.1%})"]
        elif self.done:
            figures = [f"{self.done:,}"]
        figures += [self.note] if self.note else []
        figures.append(f"{_clock(passed)} so far")
        if self.total and self.done > self._before:
            figures.append(f"{_clock(passed / (self.done - self._before) * (self.total - self.done))} left")
        return f"{self.title}: {', '.join(figures)}"


def over(title: str, items: Iterable[Item]) -> Iterator[Item]:
    """The items one by one, as a step that counts them."""
    with Step(title, len(items) if isinstance(items, Sized) else None) as advance:
        for item in items:
            yield item
            advance()


_STEPS: list[Step] = []
"""Steps under way, the outermost first."""
_SHOWN = threading.Lock()
"""Held while steps are shown."""


@contextlib.contextmanager
def shown(title: str) -> Iterator[None]:
    """Show the steps of the block, itself one of them. Inside another one this does nothing. Raises ConfigError."""
    every_s = _every_s()
    if not _SHOWN.acquire(blocking=False):
        yield
        return
    ended = threading.Event()
    watcher = threading.Thread(target=_watch, args=(ended, every_s), daemon=True)
    try:
        with Step(title):
            watcher.start()
            try:
                yield
            finally:
                ended.set()
                watcher.join()
    finally:
        _SHOWN.release()


def _every_s() -> float:
    text = os.environ.get(VARIABLE, "")
    try:
        seconds = float(text or EVERY_S)
    except ValueError:
        seconds = -1.0
    if not 0 < seconds <= threading.TIMEOUT_MAX:
        raise ConfigError(f"{VARIABLE}: {text[:60]!r} is wrong, expected the seconds between two lines, above 0")
    return seconds


def _watch(ended: threading.Event, every_s: float) -> None:
    begun = time.monotonic()
    if ended.wait(min(BAR_AFTER_S, every_s)):
        return
    from evslip.utils.console import console

    with contextlib.suppress(OSError, ValueError):  # nobody reads them any more
        if console.is_terminal:
            _draw(ended)
            return
        while not ended.wait(max(0.0, every_s - (time.monotonic() - begun))):
            begun = time.monotonic()
            text = "; ".join(step.line() for step in _worth_showing())
            print(stamped(text), file=sys.stderr, flush=True)  # what is printed else may be for a machine


def stamped(text: str) -> str:
    """A line of a log."""
    return f"{datetime.now():%Y-%m-%d %H:%M:%S}  {text}"


def _worth_showing() -> list[Step]:
    """Steps under way; the whole command only where nothing more is known."""
    steps = _STEPS.copy()
    return steps[1:] or steps


def _draw(ended: threading.Event) -> None:
    with _new_bars() as bar:
        drawn: dict[Step, Any] = {}
        while not ended.wait(DRAWN_EVERY_S):
            steps = _worth_showing()
            for gone in drawn.keys() - set(steps):
                bar.remove_task(drawn.pop(gone))
            for step in steps:
                if step not in drawn:
                    drawn[step] = bar.add_task(step.title, total=None, note="")
                bar.update(drawn[step], completed=step.done, total=step.total, note=step.note)


def _new_bars() -> Any:
    """Bars for steps, which go when they end; not yet shown."""
    from rich import progress as rich

    from evslip.utils.console import console

    columns = (rich.TextColumn("{task.description}"), rich.BarColumn(16), rich.MofNCompleteColumn())
    times = (rich.TimeElapsedColumn(), rich.TextColumn("left"), rich.TimeRemainingColumn())
    note = rich.TextColumn("{task.fields[note]}")
    return rich.Progress(*columns, *times, note, console=console, speed_estimate_period=SPEED_OVER_S, transient=True)


def _clock(seconds: float) -> str:
    return str(timedelta(seconds=round(seconds)))
