"""What the applications share: files of pages, and messages over a websocket."""

import asyncio
import contextlib
import json
import struct
from collections.abc import Callable, Coroutine, Mapping, Sequence
from functools import cache
from importlib import resources
from importlib.resources.abc import Traversable
from string import Template
from typing import Any

import numpy as np
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response
from starlette.websockets import WebSocket, WebSocketDisconnect

from evslip.events.stream import Events

KINDS = {"css": "text/css", "js": "text/javascript"}
MOST_EVENTS = 30_000
"""Events in a message; of more, the newest."""


@cache
def files(*kinds: str) -> dict[str, Traversable]:
    """Files of all pages whose names end so, by name."""
    folders = (resources.files("evslip.view").joinpath(name, "static") for name in ("explorer", "live", "play"))
    return {file.name: file for folder in folders for file in folder.iterdir() if file.name.endswith(kinds)}


def page(name: str, script: str, title: str = "evslip", style: str | None = None) -> Response:
    """A page, under the head that all have; `style` is a style sheet beside the common one."""
    head, player, body = (
        Template(files(".html")[f"{one}.html"].read_text("utf-8")) for one in ("head", "player", name)
    )
    styles = "" if style is None else f'\n<link rel="stylesheet" href="/static/{style}">'
    shown = head.substitute(title=title, styles=styles, script=script)
    return HTMLResponse(body.substitute(head=shown, player=player.template))


def static(request: Request) -> Response:
    """A script or style sheet."""
    name = request.path_params["name"]
    known = files(*KINDS)
    if name not in known:
        raise HTTPException(404, "no such file")
    return Response(known[name].read_bytes(), media_type=KINDS[name.rpartition(".")[2]])


async def talk(
    socket: WebSocket,
    send: Callable[[], Coroutine[Any, Any, None]],
    take: Callable[[str], str | None] = lambda text: None,
) -> None:
    """Run `send` until a page goes, and meanwhile hand over what the page says; what `take` answers is sent to it.
    Bytes say nothing: no page of ours sends any."""
    await socket.accept()
    sending = asyncio.create_task(send())
    try:
        with contextlib.suppress(WebSocketDisconnect):
            while (message := await socket.receive())["type"] == "websocket.receive":
                text = message.get("text")
                if text is not None and (answer := take(text)):
                    await socket.send_text(answer)
    finally:
        sending.cancel()


def event_words(parts: Sequence[Events], size: tuple[int, int]) -> np.ndarray:
    """The newest events on a sensor of some width and height, little-endian uint32 of shape (n,): x in bits 0 to 11, y
    in 12 to 23, polarity in bit 24."""
    x, y, p = (np.concatenate([np.zeros(0, np.uint16), *(getattr(part, key) for part in parts)]) for key in "xyp")
    inside = (x < min(size[0], 4096)) & (y < min(size[1], 4096))
    words = x.astype("<u4") | y.astype("<u4") << 12 | p.astype("<u4") << 24
    return words[inside][-MOST_EVENTS:]


def packed(head: Mapping[str, Any], *arrays: np.ndarray) -> bytes:
    """A message: length of the head as little-endian uint32, the head as JSON, then the arrays."""
    text = json.dumps(head).encode()
    text += b" " * (-len(text) % 4)
    return b"".join([struct.pack("<I", len(text)), text, *(array.tobytes() for array in arrays)])
