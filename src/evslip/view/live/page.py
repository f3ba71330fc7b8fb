"""Page that shows a live stream: events, slip probability, alarms, counters."""

import asyncio
import json
import struct
import threading
from importlib import resources
from typing import Any

import numpy as np
from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from evslip.events.stream import Events
from evslip.learn.streaming.live import Answered, Note, Report
from evslip.view.web.guard import Guard

FILES = {
    "live.html": ("evslip.view.live", "text/html"),
    "live.js": ("evslip.view.live", "text/javascript"),
    "curves.js": ("evslip.view.play", "text/javascript"),
    "play.css": ("evslip.view.play", "text/css"),
    "style.css": ("evslip.view.explorer", "text/css"),
}
CURVES = ("t_s", "p_slip", "delay_ms", "rate_mhz")
"""Columns of the curves."""
PICTURE_S = 0.04
"""Time between two messages to a page."""
MOST_EVENTS = 30_000
"""Events in a message; of more, the newest."""
MOST_ROWS = 2_000
MOST_NOTES = 8


class LiveView:
    """The newest reports, which pages are shown; bounded. Threads may put and take."""

    def __init__(self, name: str, size: tuple[int, int] | None):
        self.name, self.size, self.threshold = name, size or (346, 260), 0.5
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
        """Take a report of the detector."""
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
        self.threshold = found.threshold
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
        """Number of rows so far, and what is new since so many: length of the head as uint32, the head as JSON, events
        as uint32 (x in bits 0 to 11, y in 12 to 23, polarity in bit 24). All little-endian."""
        with self._lock:
            new = min(self._number - since, len(self._rows))
            rows = self._rows[len(self._rows) - new :] if new > 0 else []
            parts, number, size = self._events, self._number, self.size
            state = {"notes": self._notes, "counters": self._counters, "slip": self._slip, "over": self.is_over}
        newest_us = int(parts[-1].t_us[-1]) if parts else 0
        shown = [part.between(newest_us - round(PICTURE_S * 1e6), newest_us + 1) for part in parts[-50:]]
        x, y, p = (np.concatenate([getattr(part, key) for part in shown] or [np.zeros(0, np.uint16)]) for key in "xyp")
        inside = (x < min(size[0], 4096)) & (y < min(size[1], 4096))
        words = x.astype(np.uint32) | y.astype(np.uint32) << 12 | p.astype(np.uint32) << 24
        words = words[inside][-MOST_EVENTS:]
        head = {"rows": rows, "size": size, "name": self.name, "threshold": self.threshold, **state}
        text = json.dumps(head).encode()
        text += b" " * (-len(text) % 4)
        return number, b"".join([struct.pack("<I", len(text)), text, words.astype("<u4").tobytes()])


def make_app(view: LiveView, hosts: list[str]) -> Any:
    """The application, which answers to the given values of the Host header alone."""

    def file(request: Request) -> Response:
        name = request.path_params.get("name", "live.html")
        if name not in FILES:
            raise HTTPException(404, "no such file")
        folder, kind = FILES[name]
        return Response(resources.files(folder).joinpath("static", name).read_bytes(), media_type=kind)

    def about(request: Request) -> Response:
        return JSONResponse({"curves": CURVES, "name": view.name})

    async def send(socket: WebSocket) -> None:
        number = 0
        while True:
            number, packed = view.message(number)
            await socket.send_bytes(packed)
            await asyncio.sleep(PICTURE_S)

    async def stream(socket: WebSocket) -> None:
        await socket.accept()
        sending = asyncio.create_task(send(socket))
        try:
            while True:
                await socket.receive_text()
        except WebSocketDisconnect:
            pass
        finally:
            sending.cancel()

    routes = [
        Route("/", file),
        Route("/static/{name}", file),
        Route("/api/about", about),
        WebSocketRoute("/api/stream", stream),
    ]
    return Guard(Starlette(routes=routes), hosts)
