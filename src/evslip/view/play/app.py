"""The page as a web application."""

import asyncio
import json
from dataclasses import asdict
from importlib import resources
from typing import Any

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from evslip.utils.errors import EvslipError
from evslip.view.play.messages import CURVES
from evslip.view.play.settings import SETTINGS
from evslip.view.play.world import World
from evslip.view.web.guard import Guard

FILES = {"play.html": "text/html", "play.js": "text/javascript", "curves.js": "text/javascript", "play.css": "text/css"}
LOOK_S = 0.005
"""Time between two looks for a new message."""


class PlayPage:
    """Answers to the page about one world."""

    def __init__(self, world: World):
        self.world = world

    def file(self, request: Request) -> Response:
        """The page itself, or what belongs to it."""
        name = request.path_params.get("name", "play.html")
        if name == "style.css":
            folder, kind = "evslip.view.explorer", "text/css"
        elif name in FILES:
            folder, kind = "evslip.view.play", FILES[name]
        else:
            raise HTTPException(404, "no such file")
        return Response(resources.files(folder).joinpath("static", name).read_bytes(), media_type=kind)

    def about(self, request: Request) -> Response:
        """Settings, and the names of the curves."""
        return JSONResponse({"settings": {name: asdict(one) for name, one in SETTINGS.items()}, "curves": CURVES})

    async def stream(self, socket: WebSocket) -> None:
        """Messages to one page, and its commands."""
        await socket.accept()
        self.world.viewers += 1
        sending = asyncio.create_task(self._send(socket))
        try:
            while True:
                await self._take(socket, await socket.receive_text())
        except WebSocketDisconnect:
            pass
        finally:
            sending.cancel()
            self.world.viewers -= 1

    async def _take(self, socket: WebSocket, text: str) -> None:
        try:
            self.world.command(json.loads(text))
        except (ValueError, RecursionError):
            await socket.send_text("expected JSON")
        except EvslipError as error:
            await socket.send_text(str(error))

    async def _send(self, socket: WebSocket) -> None:
        sequence = 0
        while True:
            found = self.world.since(sequence)
            if found is None:
                await asyncio.sleep(LOOK_S)
                continue
            sequence, packed = found
            await socket.send_bytes(packed)


def make_app(world: World, hosts: list[str]) -> Any:
    """The application, which answers to the given values of the Host header alone."""
    page = PlayPage(world)
    routes = [
        Route("/", page.file),
        Route("/static/{name}", page.file),
        Route("/api/about", page.about),
        WebSocketRoute("/api/stream", page.stream),
    ]
    return Guard(Starlette(routes=routes), hosts)
