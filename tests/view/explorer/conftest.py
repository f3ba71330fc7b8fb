"""Real servers, and a real browser that opens their pages."""

import shutil
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from evslip.data import record_file
from evslip.data.record import Record
from evslip.view.explorer.app import Explorer, make_app
from evslip.view.explorer.labels import Labels
from evslip.view.explorer.shelf import Shelf
from sample_records import random_events

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


class Served:
    """A server of its own thread, at a free port or the given one."""

    def __init__(self, explorer: Explorer, port: int = 0):
        import uvicorn

        guard = make_app(explorer, [])
        self._server = uvicorn.Server(uvicorn.Config(guard, port=port, log_level="warning", ws="none", lifespan="off"))
        self._thread = threading.Thread(target=self._server.run)
        self._thread.start()
        while not self._server.started:
            time.sleep(0.01)
        self.port = self._server.servers[0].sockets[0].getsockname()[1]
        self.url = f"http://127.0.0.1:{self.port}/"
        guard._hosts = frozenset([f"127.0.0.1:{self.port}"])

    def stop(self) -> None:
        self._server.should_exit = True
        self._thread.join()


@pytest.fixture
def serve() -> Iterator[Callable[..., Served]]:
    """Starts servers, and stops what is left of them."""
    servers: list[Served] = []

    def serving(shelf: Shelf, labels: Labels | None = None, port: int = 0) -> Served:
        servers.append(Served(Explorer(shelf, labels=labels), port))
        return servers[-1]

    yield serving
    for server in servers:
        server.stop()


@pytest.fixture(scope="module")
def browser() -> Iterator:
    if CHROMIUM is None:
        pytest.skip("needs a Chromium browser on the path")
    from playwright import sync_api

    with sync_api.sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield started
        started.close()


@pytest.fixture
def complaints() -> list[str]:
    """What the consoles of open pages complained of; a test that expects some takes them out."""
    return []


@pytest.fixture
def visit(browser, complaints: list[str]) -> Iterator:
    """Opens the page of an address, and fails if its console complains."""
    pages = []

    def visiting(url: str, size: tuple[int, int] = (1280, 800)):
        page = browser.new_page(viewport={"width": size[0], "height": size[1]})
        pages.append(page)
        page.on("console", lambda m: complaints.append(m.text) if m.type == "error" else None)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.goto(url)
        return page

    yield visiting
    for page in pages:
        page.close()
    assert complaints == []


@pytest.fixture
def open_page(serve: Callable[..., Served], visit) -> Callable:
    """Serves a shelf and opens its page."""
    return lambda shelf, labels=None, size=(1280, 800): visit(serve(shelf, labels).url, size)


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    path = tmp_path / "r.h5"
    events = random_events(np.random.default_rng(0), 500, labelled=False)
    record_file.write(path, Record(kind="recording", name="r", size=(40, 30), events=events))
    return path
