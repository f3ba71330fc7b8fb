"""Run a web application on this machine, for this machine alone."""

import socket
import webbrowser
from collections.abc import Callable
from importlib import import_module
from typing import Any

from evslip.utils.console import console
from evslip.utils.errors import ConfigError, MissingExtraError

ADDRESS = "127.0.0.1"


def require_server(port: int) -> Any:
    """The package that serves, where all that it takes is installed. Raises MissingExtraError, and ConfigError for a
    port that cannot be one."""
    try:
        for name in ("starlette", "websockets"):
            import_module(name)
        server = import_module("uvicorn")
    except ImportError as error:
        raise MissingExtraError(f"the pages need the package {error.name}: pip install 'evslip[view]'") from None
    if not 0 <= port <= 65535:
        raise ConfigError(f"port: {port} is out of range, expected 0 to 65535")
    return server


def serve(make_app: Callable[[list[str]], Any], *, port: int, browser: bool, streams: bool = False) -> None:
    """Serve an application until Ctrl-C. Port 0 takes a free one; the address is printed when it answers there.

    make_app: gives the application, from the values of the Host header that it shall answer to. streams: whether it has
    websockets. Raises ConfigError, MissingExtraError.
    """
    uvicorn = require_server(port)
    with socket.socket() as listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((ADDRESS, port))
        except OSError as error:
            reason = f"{port} cannot be used ({error.strerror})"
            raise ConfigError(f"port: {reason}; give another one, or 0 for a free one") from None
        port = listener.getsockname()[1]
        app = make_app([f"{ADDRESS}:{port}", f"localhost:{port}"])
        kind = "auto" if streams else "none"
        server = uvicorn.Server(uvicorn.Config(app, log_level="warning", ws=kind, lifespan="off"))
        listener.listen()
        address = f"http://{ADDRESS}:{port}/"
        console.print(f"{address}  (Ctrl-C ends it)", soft_wrap=True)
        if browser:
            webbrowser.open(address)
        server.run([listener])
