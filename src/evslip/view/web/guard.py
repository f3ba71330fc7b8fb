"""Requests that a local server must refuse, although only this machine can reach it.

A web page anywhere may send requests to a port of the visitor's own machine. So the Host header must name this
machine (a foreign name that resolves to it is refused), and what writes must come from our own pages.
"""

from collections.abc import Iterable
from typing import Any

from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

MOST_BYTES = 1_000_000
"""Most bytes of a request's body."""
MOST_QUERY = 1000
"""Characters of a query."""
READING, WRITING = ("GET", "HEAD"), ("PUT",)
HEADERS = (
    (b"content-security-policy", b"default-src 'self'; img-src 'self' blob: data:; style-src 'self' 'unsafe-inline'; "
     b"base-uri 'none'; form-action 'none'; frame-ancestors 'none'"),
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-resource-policy", b"same-origin"),
)  # fmt: skip
"""Headers of every response: nothing is loaded from elsewhere, and no other page may embed or read ours."""


class Guard:
    """Middleware: checks every request before anything else sees it."""

    def __init__(self, app: ASGIApp, hosts: Iterable[str]):
        self._app, self._hosts = app, frozenset(hosts)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "websocket" and not self._is_own_page(scope):
            # Browsers let any page connect, and say from where it comes.
            await send({"type": "websocket.close", "code": 1008})
            return
        if scope["type"] in ("websocket", "lifespan"):
            await self._app(scope, receive, send)
        if scope["type"] != "http":
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message.get("headers", []), *HEADERS]
            await send(message)

        refusal = self._refusal(scope)
        if refusal is not None:
            await PlainTextResponse(refusal[1] + "\n", refusal[0])(scope, receive, send_with_headers)
            return
        await self._app(scope, limited(receive), send_with_headers)

    def _is_own_page(self, scope: Scope) -> bool:
        headers = {name: value.decode("latin-1") for name, value in scope["headers"]}
        host = headers.get(b"host", "")
        return host in self._hosts and headers.get(b"origin") == f"http://{host}"

    def _refusal(self, scope: Scope) -> tuple[int, str] | None:
        headers = {name: value.decode("latin-1") for name, value in scope["headers"]}
        host, method = headers.get(b"host", ""), scope["method"]
        if host not in self._hosts:
            return 403, "this server answers to its own address only"
        if method not in READING + WRITING:
            return 405, "expected GET, HEAD or PUT"
        if len(scope["query_string"]) > MOST_QUERY:
            return 414, "the query is too long"
        length = headers.get(b"content-length", "0")
        if not length.isdecimal() or int(length) > MOST_BYTES:
            return 413, f"a request may hold at most {MOST_BYTES} bytes"
        if method in WRITING:
            if headers.get(b"content-type", "").partition(";")[0] != "application/json":
                return 415, "expected application/json"
            if headers.get(b"origin") not in (None, f"http://{host}"):
                return 403, "written from another page"
        return None


def limited(receive: Receive) -> Receive:
    """Body of a request, cut off where it grows beyond MOST_BYTES without having said so."""
    seen = 0

    async def receive_some() -> Message:
        nonlocal seen
        message: Any = await receive()
        seen += len(message.get("body", b""))
        if seen > MOST_BYTES:
            return {"type": "http.disconnect"}
        return message

    return receive_some
