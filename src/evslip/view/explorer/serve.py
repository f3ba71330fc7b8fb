"""Run the pages on this machine."""

from pathlib import Path

from evslip.view.explorer.labels import Labels
from evslip.view.explorer.shelf import Shelf
from evslip.view.web.serving import require_server, serve


def explore(
    shelf: Shelf,
    *,
    port: int,
    model: Path | None = None,
    labels: Labels | None = None,
    browser: bool = True,
) -> None:
    """Serve the pages until Ctrl-C, as of `serve`. With `labels`, the page that edits them.

    Raises ConfigError, DataError, MissingExtraError.
    """
    require_server(port)
    from evslip.view.explorer.app import Explorer, make_app

    if model is not None:
        from evslip.learn import load_model

        load_model(model)  # one that cannot be read is refused before a page opens
    explorer = Explorer(shelf, model, labels)
    serve(lambda hosts: make_app(explorer, hosts), port=port, browser=browser)
