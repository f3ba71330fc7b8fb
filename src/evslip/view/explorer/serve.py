"""Run the pages on this machine."""

import socket
import webbrowser
from pathlib import Path

from evslip.utils.console import console
from evslip.utils.errors import ConfigError, MissingExtraError
from evslip.view.explorer.labels import Labels
from evslip.view.explorer.shelf import Shelf

ADDRESS = "127.0.0.1"


def explore(
    shelf: Shelf,
    *,
    port: int,
    model: Path | None = None,
    labels: Labels | None = None,
    browser: bool = True,
) -> None:
    """Serve the pages until Ctrl-C. Port 0 takes a free one; the address is printed when the pages answer there.

    With `labels`, the page that edits them. Raises ConfigError, DataError, MissingExtraError.
    """
    try:
        import uvicorn

        from evslip.view.explorer.app import Explorer, make_app
    except ImportError as error:
        raise MissingExtraError(f"the pages need the package {error.name}: pip install 'evslip[view]'") from None
    if not 0 <= port <= 65535:
        raise ConfigError(f"port: {port} is out of range, expected 0 to 65535")
    if model is not None:
        from evslip.learn import load_model

        load_model(model)  # one that cannot be read is refused before a page opens
    with socket.socket() as listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((ADDRESS, port))
        except OSError as error:
            reason = f"{port} cannot be used ({error.strerror})"
            raise ConfigError(f"port: {reason}; give another one, or 0 for a free one") from None
        port = listener.getsockname()[1]
        app = make_app(Explorer(shelf, model, labels), [f"{ADDRESS}:{port}", f"localhost:{port}"])
        server = uvicorn.Server(uvicorn.Config(app, log_level="warning", ws="none", lifespan="off"))
        listener.listen()
        address = f"http://{ADDRESS}:{port}/"
        console.print(f"{address}  (Ctrl-C ends it)", soft_wrap=True)
        if browser:
            webbrowser.open(address)
        server.run([listener])
