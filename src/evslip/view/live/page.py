"""Page that shows a live stream: events, slip probability, alarms, counters."""

import asyncio
import threading
from typing import Any

from starlette.applications import Starlette
from starlette.responses import JSONResponse
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket

from evslip.events.stream import Events
from evslip.learn.streaming.live import Answered, Note, Report
from evslip.view.web.guard import Guard
from evslip.view.web.pages import MOST_EVENTS, event_words, packed, page, static, talk

CURVES = ("t_s", "p_slip", "delay_ms", "rate_mhz")
"""Columns of the curves."""
PICTURE_S = 0.04
"""Time between two messages to a page."""
MOST_ROWS = 2_000
MOST_NOTES = 8


class LiveView:
    """The newest reports, which pages are shown; bounded. Threads may put and take."""

    def __init__(self, name: str, size: tuple[int, int] | None):
        self.name, self.size = name, size or (346, 260)
        self._lock = threading.Lock()
        self._rows: list[list[float | None]] = []
        self._number = 0
        """Rows that were put so far."""
        self._events: list[Events] = []
        self._notes: list[str] = []
        self._counters: dict[str, Any] = {}
        self._slip = self.is_over = False
        self._rate = 0.0

    def put(self, report: Report) -> None:
        with self._lock:
            if isinstance(report, Note):
                self._notes = [*self._notes, report.text][-MOST_NOTES:]
            elif isinstance(report, Answered):
                self._answered(report)
            else:
                self._counters, self._rate = report.as_json() | {"line": report.counters.line()}, report.rate_hz / 1e6
                self.is_over = report.final

    def _answered(self, report: Answered) -> None:
        found = report.detection
        values = zip(found.t_us.tolist(), found.p_slip.tolist(), report.delay_ms.tolist(), strict=True)
        rows: list[list[float | None]] = [[t_us / 1e6, round(p, 4), round(d, 2), self._rate] for t_us, p, d in values]
        if rows:
            self._slip = bool(report.slips[-1])
        self._number += len(rows)
        self._rows = [*self._rows, *rows][-MOST_ROWS:]
        if report.events.count:
            self._events = [*self._events, report.events.select(slice(-MOST_EVENTS, None))]
            if sum(part.count for part in self._events[1:]) > MOST_EVENTS:
                self._events = self._events[1:]

    def message(self, since: int) -> tuple[int, bytes]:
        """Number of rows so far, and what is new since so many as `packed`: rows and state, events as `event_words`."""
        with self._lock:
            new = min(self._number - since, len(self._rows))
            rows = self._rows[len(self._rows) - new :] if new > 0 else []
            parts, number, size = self._events, self._number, self.size
            state = {"notes": self._notes, "counters": self._counters, "slip": self._slip, "over": self.is_over}
        newest_us = int(parts[-1].t_us[-1]) if parts else 0
        shown = [part.between(newest_us - round(PICTURE_S * 1e6), newest_us + 1) for part in parts[-50:]]
        return number, packed({"rows": rows, "size": size, **state}, event_words(shown, size))


def make_app(view: LiveView, hosts: list[str]) -> Any:
    """The application, which answers to the given values of the Host header alone."""

    async def send(socket: WebSocket) -> None:
        number = 0
        while True:
            number, message = view.message(number)
            await socket.send_bytes(message)
            await asyncio.sleep(PICTURE_S)

    async def stream(socket: WebSocket) -> None:
        await talk(socket, lambda: send(socket))

    routes = [
        Route("/", lambda request: page("live", "live", "evslip live", "play.css")),
        Route("/static/{name}", static),
        Route("/api/about", lambda request: JSONResponse({"curves": CURVES, "name": view.name})),
        WebSocketRoute("/api/stream", stream),
    ]
    return Guard(Starlette(routes=routes), hosts)
