"""Run the page on this machine."""

import threading

from evslip.view.web.serving import require_server, serve


def play(*, config: str, controller: str, model: str, port: int, browser: bool) -> None:
    """Serve the page until Ctrl-C, as of `serving.serve`. Raises ConfigError, DataError, MissingExtraError."""
    require_server(port)
    from evslip.view.play.app import make_app
    from evslip.view.play.world import World

    world, stop = World(config, controller, model), threading.Event()
    loop = threading.Thread(target=world.run, args=(stop,), daemon=True)
    loop.start()
    try:
        serve(lambda hosts: make_app(world, hosts), port=port, browser=browser, streams=True)
    finally:
        stop.set()
        loop.join(timeout=5.0)
