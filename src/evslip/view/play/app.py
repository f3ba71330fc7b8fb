"""The page as a web application."""

import asyncio
import json
from dataclasses import asdict
from typing import Any

from starlette.applications import Starlette
from starlette.responses import JSONResponse
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket

from evslip.utils.errors import EvslipError
from evslip.view.play.messages import CURVES
from evslip.view.play.settings import SETTINGS
from evslip.view.play.world import World
from evslip.view.web.guard import Guard
from evslip.view.web.pages import page, static, talk

LOOK_S = 0.005
"""Time between two looks for a new message."""


class Hand:
    """What one page does to the world."""

    def __init__(self, world: World):
        self._world, self._pulls = world, False

    def take(self, text: str) -> str | None:
        """Hand a command over; what is wrong with it, if anything."""
        try:
            given = json.loads(text)
            self._world.command(given)
        except (ValueError, RecursionError):
            return "expected JSON"
        except EvslipError as error:
            return str(error)
        self._pulls = any(given["pull"]) if "pull" in given else self._pulls
        return None

    def let_go(self) -> None:
        """End a pull of this page: one that is closed cannot end it."""
        if self._pulls:
            self._world.command({"pull": [0, 0]})


def make_app(world: World, hosts: list[str]) -> Any:
    """The application, which answers to the given values of the Host header alone."""
    about = {"settings": {name: asdict(one) for name, one in SETTINGS.items()}, "curves": CURVES}

    async def send(socket: WebSocket) -> None:
        sequence = 0
        while True:
            found = world.since(sequence)
            if found is None:
                await asyncio.sleep(LOOK_S)
                continue
            sequence, message = found
            await socket.send_bytes(message)

    async def stream(socket: WebSocket) -> None:
        hand = Hand(world)
        world.viewers += 1
        try:
            await talk(socket, lambda: send(socket), hand.take)
        finally:
            world.viewers -= 1
            hand.let_go()

    routes = [
        Route("/", lambda request: page("play", "play", "evslip play", "play.css")),
        Route("/static/{name}", static),
        Route("/api/about", lambda request: JSONResponse(about)),
        WebSocketRoute("/api/stream", stream),
    ]
    return Guard(Starlette(routes=routes), hosts)
