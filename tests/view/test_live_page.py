"""The page of a live stream, and answers to a controller, of a program that hears a real sender."""

import contextlib
import json
import signal
import socket
import struct
import subprocess
import sys
import threading

import numpy as np
import pytest
import websockets.sync.client
import websockets.sync.server

from evslip.codecs import write_events
from evslip.events.stream import Events
from evslip.exchange.live.outlet import Outlet
from evslip.utils.errors import ConfigError


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    rng, path = np.random.default_rng(0), tmp_path_factory.mktemp("live") / "some.h5"
    t_us = np.sort(rng.integers(0, 1_000_000, 50_000))
    columns = rng.integers(0, 346, 50_000, np.uint16), rng.integers(0, 260, 50_000, np.uint16), t_us % 2 == 0
    write_events(path, Events(t_us, *columns), (346, 260))
    return path


def test_page_and_controller_get_what_is_answered(recording):
    with socket.socket(type=socket.SOCK_DGRAM) as controller:
        controller.bind(("127.0.0.1", 0))
        controller.settimeout(60)
        to = f"udp://127.0.0.1:{controller.getsockname()[1]}"
        words = ["live", str(recording), "--page", "0", "--to", to, "--hop-s", "0.02", "--once"]
        process = subprocess.Popen([sys.executable, "-m", "evslip", *words], stdout=subprocess.PIPE, text=True)
        try:
            assert process.stdout is not None
            address = next(line for line in process.stdout if line.startswith("http")).split()[0].rstrip("/")
            answer = json.loads(controller.recv(2000))
            assert {"t_us", "p_slip", "slip", "events", "delay_ms"} <= set(answer)
            place = address.replace("http", "ws") + "/api/stream"
            with websockets.sync.client.connect(place, origin=address) as page:
                rows, events = [], 0
                while True:
                    data = page.recv(timeout=20)
                    assert isinstance(data, bytes)
                    (length,) = struct.unpack_from("<I", data)
                    head = json.loads(data[4 : 4 + length])
                    rows += head["rows"]
                    events = max(events, (len(data) - 4 - length) // 4)
                    if head["over"]:
                        break
            assert head["size"] == [346, 260] and events > 100
            assert len(rows) == head["counters"]["answers"] > 3
            assert head["counters"]["received"] == 50_000
        finally:
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=20)
        assert process.returncode in (0, 130)


def test_page_and_terminal_tell_why_a_stream_failed_at_once(tmp_path):
    t_us = np.arange(0, 100_000, 100)
    pixels = (t_us % 16).astype(np.uint16)
    write_events(tmp_path / "small.h5", Events(t_us, pixels, pixels, t_us % 3 == 0), (16, 16))
    words = ["live", str(tmp_path / "small.h5"), "--align", "corner", "--page", "0"]
    process = subprocess.Popen([sys.executable, "-m", "evslip", *words], stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        lines, found = iter(process.stdout.readline, ""), {}
        while len(found) < 2:
            line = next(lines)
            found |= {kind: line for kind in ("http", "note: ") if line.startswith(kind)}
        address = found["http"].split()[0].rstrip("/")
        with websockets.sync.client.connect(address.replace("http", "ws") + "/api/stream", origin=address) as page:
            data = page.recv(timeout=20)
            assert isinstance(data, bytes)
            (length,) = struct.unpack_from("<I", data)
            head = json.loads(data[4 : 4 + length])
        assert head["over"] and found["note: "].strip()[:40] == f"note: {head['notes'][-1]}"[:40]
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=20)


def test_a_websocket_gets_lines_also_after_it_came_back():
    got, came = [], threading.Event()

    def hear(connection) -> None:
        with contextlib.suppress(Exception):
            for line in connection:
                got.append(line)
                came.set()

    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        port = one.getsockname()[1]
    outlet = Outlet(f"ws://127.0.0.1:{port}/answers")
    try:
        outlet.send("before")
        for line in ("first", "second"):
            came.clear()
            with websockets.sync.server.serve(hear, "127.0.0.1", port) as server:
                threading.Thread(target=server.serve_forever, daemon=True).start()
                while line not in got:
                    outlet.send(line)
                    came.wait(0.1)
                server.shutdown()
        assert got[0] == "before" and "second" in got
    finally:
        outlet.close()


def test_a_receiver_that_takes_nothing_costs_no_memory():
    outlet = Outlet("ws://127.0.0.1:9/nowhere")
    for number in range(1000):
        outlet.send(str(number))
    assert outlet.dropped >= 700
    outlet._waiting.queue.clear()
    outlet.close()


def test_a_wrong_address_is_told():
    with pytest.raises(ConfigError, match="expected udp://HOST:PORT or ws://"):
        Outlet("http://a")
