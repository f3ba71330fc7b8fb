"""The page of a hand that is pulled at, in a real browser."""

import shutil
import threading
import time
from collections.abc import Callable, Iterator

import pytest
import uvicorn
from playwright import sync_api

from evslip.view.play.app import make_app
from evslip.view.play.world import World

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
pytestmark = [pytest.mark.slow, pytest.mark.skipif(CHROMIUM is None, reason="needs a Chromium browser on the path")]

WAIT_S = 90.0
"""Another object takes ten seconds on a busy machine."""
MASS = "label:has(#set-mass_g) output"
"""What is said beside the slider of the mass."""


@pytest.fixture
def world() -> World:
    return World(controller="off")


@pytest.fixture
def open_page(world: World) -> Iterator[Callable[[], sync_api.Page]]:
    """Opens pages of one program that runs, and fails if their consoles complain."""
    guard, stop, messages = make_app(world, []), threading.Event(), []
    server = uvicorn.Server(uvicorn.Config(guard, port=0, log_level="warning", lifespan="off"))
    threads = [threading.Thread(target=server.run), threading.Thread(target=world.run, args=(stop,))]
    for thread in threads:
        thread.start()
    while not server.started:
        time.sleep(0.01)
    address = f"127.0.0.1:{server.servers[0].sockets[0].getsockname()[1]}"
    guard._hosts = frozenset([address])
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])

        def opening() -> sync_api.Page:
            page = browser.new_page(viewport={"width": 1280, "height": 1200})
            page.on("console", lambda m: messages.append(m.text) if m.type == "error" else None)
            page.on("pageerror", lambda error: messages.append(str(error)))
            page.goto(f"http://{address}/")
            sync_api.expect(page.locator("#title")).to_contain_text("/", timeout=WAIT_S * 1e3)
            return page

        yield opening
        browser.close()
    server.should_exit = True
    stop.set()
    for thread in threads:
        thread.join()
    assert messages == []


def wait_until(condition: Callable[[], bool]) -> None:
    end_s = time.monotonic() + WAIT_S
    while not condition():
        assert time.monotonic() < end_s
        time.sleep(0.02)


def says(page: sync_api.Page, place: str, text: str) -> None:
    sync_api.expect(page.locator(place)).to_have_text(text, timeout=WAIT_S * 1e3)


def test_every_page_shows_that_the_program_is_paused_and_what_is_pressed_meanwhile(world: World, open_page) -> None:
    page, other = open_page(), open_page()
    page.click("#pause")
    for one in (page, other):
        says(one, "#pause", "go on")
    page.reload()
    says(page, "#pause", "go on")
    says(page, "#pace", "paused")
    before = page.text_content("#title") or ""
    page.click("text=next object")
    sync_api.expect(page.locator("#title")).not_to_have_text(before, timeout=WAIT_S * 1e3)
    says(other, "#title", page.text_content("#title") or "")
    begun_us = world._episode.t_us
    world.command({"set": {"mass_g": 40.0}})
    says(page, MASS, "40 g")
    for grams in (90, 140):
        page.click("text=+ 50 g")
        for one in (page, other):
            says(one, MASS, f"{grams} g")
    assert world._episode.t_us == begun_us
    other.click("#pause")
    for one in (page, other):
        says(one, "#pause", "pause")
    wait_until(lambda: world._episode.t_us > begun_us)


def test_a_page_that_is_loaded_anew_lets_the_object_go(world: World, open_page) -> None:
    page = open_page()
    # The page itself lets go as it loses the focus, if there is time for it: a stream of the test's does not.
    page.evaluate("""() => {
        new WebSocket(`ws://${location.host}/api/stream`).onopen = ({target}) => target.send('{"pull": [9, 0]}');
    }""")
    wait_until(lambda: bool(world._pulled.any()))
    page.reload()
    wait_until(lambda: not world._pulled.any())


def test_a_slider_shows_the_program_s_value_also_where_it_has_the_focus(world: World, open_page) -> None:
    page = open_page()
    page.focus("#set-mass_g")
    world.command({"set": {"mass_g": 40.0}})
    says(page, MASS, "40 g")
    page.keyboard.press("ArrowRight")
    says(page, MASS, "41 g")
    wait_until(lambda: world._episode.simulation.mass_kg == 0.041)
    page.dispatch_event("text=next object", "click")  # a click of the pointer would take the focus
    wait_until(lambda: world._episode.simulation.mass_kg != 0.041)
    says(page, MASS, f"{round(1e3 * world._episode.simulation.mass_kg, 1):g} g")
    assert page.evaluate("document.activeElement.id") == "set-mass_g"


def test_a_slider_that_is_moved_follows_the_pointer(world: World, open_page) -> None:
    page = open_page()
    box = page.locator("#set-mass_g").bounding_box()
    assert box is not None
    y = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + 0.3 * box["width"], y)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.5 * box["width"], y, steps=4)
    held = page.text_content(MASS) or ""
    wait_until(lambda: f"{1e3 * world._episode.simulation.mass_kg:.0f} g" == held)
    world.command({"set": {"mass_g": 40.0}})
    wait_until(lambda: world._episode.simulation.mass_kg == 0.04)
    page.wait_for_timeout(800)  # longer than one rests that was moved and let go
    assert page.text_content(MASS) == held
    page.mouse.up()
    says(page, MASS, "40 g")
