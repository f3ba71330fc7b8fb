"""A hand that is pulled at, and the page that shows it."""

import json
import struct
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from evslip.utils.errors import ConfigError
from evslip.view.play.app import make_app
from evslip.view.play.messages import CURVES
from evslip.view.play.settings import checked
from evslip.view.play.world import STEP_US, World

HOST = "127.0.0.1:8898"
STREAM = f"ws://{HOST}/api/stream"


@pytest.fixture
def world() -> World:
    return World(controller="off")


def read(packed: bytes) -> tuple[dict[str, Any], np.ndarray, np.ndarray]:
    """Head, picture and events of a message."""
    (length,) = struct.unpack_from("<I", packed)
    head = json.loads(packed[4 : 4 + length])
    width, height = head["size"]
    picture = np.frombuffer(packed, np.uint8, width * height, 4 + length).reshape(height, width)
    return head, picture, np.frombuffer(packed, "<u4", offset=4 + length + width * height)


def played(world: World, seconds: float) -> list[dict[str, float]]:
    """Rows of all curves in so many seconds of simulated time."""
    rows, sequence = [], 0
    for _ in range(round(seconds * 1e6 / STEP_US)):
        world.step()
        found = world.since(sequence)
        if found is not None:
            sequence, packed = found
            rows += [dict(zip(CURVES, row, strict=True)) for row in read(packed)[0]["rows"]]
    return rows


def test_a_held_object_stays_until_it_is_pulled_at(world: World):
    still = played(world, 0.6)
    assert len(still) == 30 and still[-1]["theta_deg"] < 0.1
    world.command({"pull": [0, 300]})
    pulled = played(world, 0.4)
    assert pulled[-1]["theta_deg"] > 1 or max(row["true_mm_s"] for row in pulled) > 5
    head, picture, events = read(world.since(0)[1])  # pyright: ignore[reportOptionalSubscript]
    assert picture.std() > 10
    assert len(events) == head["events"] > 100
    assert (events & 0xFFF).max() < 346 and (events >> 12 & 0xFFF).max() < 260 and set(events >> 24) <= {0, 1}


def test_settings_take_effect_and_are_published(world: World):
    world.command({"set": {"mass_g": 20.0, "friction": 1.2, "force_n": 5.0, "lamp": 2.0, "sensor": "dvxplorer"}})
    rows = played(world, 0.4)
    simulation = world._episode.simulation
    assert (simulation.mass_kg, simulation.friction) == (0.02, 1.2)
    assert rows[-1]["force_n"] == pytest.approx(5.0, abs=0.1)
    shown = read(world.since(0)[1])[0]["settings"]  # pyright: ignore[reportOptionalSubscript]
    expected = {"mass_g": 20.0, "friction": 1.2, "force_n": 5.0, "lamp": 2.0, "room": 1.0, "sensor": "dvxplorer"}
    assert shown == expected | {"controller": "off"}


def test_buttons_do_what_they_say(world: World):
    simulation = world._episode.simulation
    mass, friction, index = simulation.mass_kg, simulation.friction, world._episode.params.index
    world.command({"press": "weight"})
    world.command({"press": "wet"})
    world.step()
    assert simulation.mass_kg == pytest.approx(mass + 0.05)
    assert simulation.friction == pytest.approx(friction / 2)
    world.command({"press": "next"})
    world.step()
    assert world._episode.params.index > index


def test_the_detector_shown_does_not_catch_up_on_time_under_another_controller(world: World):
    world.command({"set": {"controller": "detector"}})
    played(world, 1.0)
    world.command({"set": {"controller": "off"}})
    rows = played(world, 0.3)
    # No window of the time before is answered.
    assert min(row["p_slip"] for row in rows) == 0 < rows[-1]["p_slip"]


@pytest.mark.parametrize(
    "command",
    [
        {}, [], {"set": 3}, {"set": {"mass_kg": 1}}, {"set": {"mass_g": "heavy"}}, {"set": {"mass_g": 1e9}},
        {"set": {"mass_g": True}}, {"set": {"sensor": "eye"}}, {"pull": [1]}, {"pull": [1, float("nan")]},
        {"pull": "up"}, {"press": "all"}, {"pause": 1}, {"stop": True},
    ],
    ids=str,
)  # fmt: skip
def test_commands_without_meaning_are_refused_in_one_line(command: Any):
    with pytest.raises(ConfigError, match=r"^[^\n]*expected[^\n]*$"):
        checked(command)


@pytest.fixture
def client(world: World) -> Iterator[TestClient]:
    stop = threading.Event()
    loop = threading.Thread(target=world.run, args=(stop,))
    loop.start()
    yield TestClient(make_app(world, [HOST]), base_url=f"http://{HOST}")
    stop.set()
    loop.join()


def test_the_page_is_sent_messages_and_sends_commands(client: TestClient, world: World):
    assert "/static/play.js" in client.get("/").text
    assert client.get("/static/style.css").status_code == client.get("/static/curves.js").status_code == 200
    assert client.get("/static/world.py").status_code == 404
    assert client.get("/api/about").json()["curves"] == list(CURVES)
    with client.websocket_connect(STREAM, headers={"origin": f"http://{HOST}"}) as socket:
        assert read(socket.receive_bytes())[0]["rows"]
        socket.send_text('{"set": {"mass_g": -1}}')
        answers = [socket.receive() for _ in range(3)]
        assert any(answer.get("text") == "mass_g: -1 is wrong, expected 5 to 400" for answer in answers)
        socket.send_text('{"set": {"mass_g": 33}}')
        shown = [read(socket.receive_bytes())[0]["settings"]["mass_g"] for _ in range(4)]
        assert shown[-1] == 33.0
    assert world.viewers == 0


def connected(client: TestClient):
    return client.websocket_connect(STREAM, headers={"origin": f"http://{HOST}"})


def wait_until(condition: Callable[[], bool]) -> None:
    end_s = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < end_s
        time.sleep(0.01)


def until(socket: Any, condition: Callable[[dict[str, Any]], Any]) -> dict[str, Any]:
    """The first head of a message that is so."""
    return next(head for head in (read(socket.receive_bytes())[0] for _ in range(500)) if condition(head))


def test_a_pause_and_what_is_done_in_it_are_published(client: TestClient, world: World):
    with connected(client) as socket:
        head = until(socket, lambda head: not head["paused"])
        socket.send_text('{"pause": true}')
        assert until(socket, lambda now: now["paused"])["title"] == head["title"]
        socket.send_text('{"press": "next"}')
        shown = until(socket, lambda now: now["title"] != head["title"])
        assert shown["paused"] and shown["rows"] == []
        socket.send_text('{"set": {"mass_g": 44}}')
        assert until(socket, lambda now: now["settings"]["mass_g"] == 44)["title"] == shown["title"]
        socket.send_text('{"pause": false}')
        until(socket, lambda now: not now["paused"] and now["rows"])


def test_a_page_that_goes_takes_its_own_pull_away(client: TestClient, world: World):
    with connected(client) as one:
        with connected(client) as other:
            one.send_text('{"pull": [0, 20]}')
            wait_until(lambda: bool(world._pulled.any()))
            other.send_text('{"set": {"mass_g": 44}}')
            wait_until(lambda: world._episode.simulation.mass_kg == 0.044)
        assert world._commands.empty() and world._pulled.any()  # the other one pulled at nothing
    wait_until(lambda: not world._pulled.any())


def test_bytes_from_a_page_are_ignored(client: TestClient, world: World):
    with connected(client) as socket:
        socket.send_bytes(b"x")
        socket.send_text('{"set": {"mass_g": 44}}')
        wait_until(lambda: world._episode.simulation.mass_kg == 0.044)


@pytest.mark.parametrize("headers", [{"origin": "http://elsewhere.net"}, {}, {"host": "elsewhere.net"}], ids=str)
def test_other_pages_cannot_connect(headers: dict[str, str]):
    client = TestClient(make_app(object.__new__(World), [HOST]), base_url=f"http://{HOST}")
    with pytest.raises(WebSocketDisconnect), client.websocket_connect(STREAM, headers=headers):
        pass
