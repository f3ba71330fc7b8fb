"""Live sources that others' packages speak, heard and spoken to by those packages."""

import socket
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

from evslip.events.stream import Events, concatenate
from evslip.exchange.live import make_source, make_target
from evslip.exchange.live.feed import Feed
from evslip.exchange.live.source import Unreachable

pytest.importorskip("dv_processing")
SIZE = (346, 260)


def some_events(count: int = 5_000, start_us: int = 5_000_000) -> Events:
    rng = np.random.default_rng(0)
    t_us = np.sort(rng.integers(0, 100_000, count)) + start_us
    return Events(t_us, rng.integers(0, 346, count, np.uint16), rng.integers(0, 260, count, np.uint16), t_us % 2 == 0)


def free_port(kind: socket.SocketKind = socket.SOCK_STREAM) -> int:
    with socket.socket(type=kind) as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def collected(feed: Feed, count: int, timeout_s: float = 10.0) -> Events:
    found, end_s = [], time.monotonic() + timeout_s
    while sum(part.count for part in found) < count and time.monotonic() < end_s:
        found += [piece.events for piece in feed.take(0.05) if piece.events.count]
    return concatenate(found)


THEIR_SERVER = """
import sys, time
import dv_processing as dv, numpy as np
port, path = int(sys.argv[1]), sys.argv[2]
writer = dv.io.NetworkWriter("127.0.0.1", port, dv.io.Stream.EventStream(0, "events", "theirs", (346, 260)))
store = dv.EventStore()
for row in np.load(path).tolist():
    store.push_back(*row)
print("ready", flush=True)
sys.stdin.readline()
writer.writeEvents(store)
sys.stdin.readline()
"""
THEIR_READER = """
import sys, time
import dv_processing as dv, numpy as np
reader, found = dv.io.NetworkReader("127.0.0.1", int(sys.argv[1])), []
print(tuple(reader.getEventResolution()), flush=True)
while sum(map(len, found)) < int(sys.argv[3]) and reader.isRunning():
    batch = reader.getNextEventBatch()
    if batch is not None:
        found.append(batch.numpy())
np.save(sys.argv[2], np.concatenate(found))
"""


def start(code: str, *words: object) -> subprocess.Popen:
    command = [sys.executable, "-c", code, *map(str, words)]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


@pytest.fixture
def path(tmp_path):
    path, events = tmp_path / "events.npy", some_events()
    np.save(path, np.stack([column.astype(np.int64) for column in events.columns], 1))
    return path


def said(process: subprocess.Popen) -> str:
    assert process.stdout is not None
    return process.stdout.readline().strip()


def say(process: subprocess.Popen) -> None:
    assert process.stdin is not None
    process.stdin.write("\n")
    process.stdin.flush()


def test_a_server_of_dv_processing_is_heard_and_found_again(path):
    port, events = free_port(), some_events()
    feed = Feed(make_source(f"dv://127.0.0.1:{port}"))
    feed.start()
    try:
        for _ in range(2):
            server = start(THEIR_SERVER, port, path)
            assert said(server) == "ready"
            wait_for(lambda: feed.counters.connected)
            time.sleep(0.2)
            say(server)
            assert collected(feed, events.count) == events
            server.kill()
            server.communicate()
            wait_for(lambda: not feed.counters.connected)
        notes = feed.notes()
    finally:
        feed.stop()
    expected = ["nobody answers", "reached", "waiting for it", "is back"]
    for part in expected:
        assert any(part in note for note in notes), notes
    assert feed.size == SIZE
    assert (feed.counters.reconnects, feed.counters.received, feed.counters.lost) == (1, 2 * events.count, 0)


def test_dv_processing_reads_what_is_sent(tmp_path):
    port, events, path = free_port(), some_events(), tmp_path / "read.npy"
    with make_target(f"dv://127.0.0.1:{port}", SIZE) as target:
        reader = start(THEIR_READER, port, path, events.count)
        assert said(reader) == str(SIZE)
        wait_for(lambda: target.clients)
        target.send(events, 0)
        reader.communicate(timeout=10)
    rows = np.load(path)
    assert np.array_equal(rows["timestamp"], events.t_us) and np.array_equal(rows["x"], events.x)
    assert np.array_equal(rows["y"], events.y) and np.array_equal(rows["polarity"] == 1, events.p)


def test_what_is_no_server_of_dv_processing_is_no_hang():
    with socket.create_server(("127.0.0.1", 0)) as silent:
        source = make_source(f"dv://127.0.0.1:{silent.getsockname()[1]}")
        with pytest.raises(Unreachable, match="nobody answers"):
            source.open()


def test_once_a_server_that_is_not_there_is_an_error():
    with pytest.raises(Unreachable, match="nobody answers"):
        Feed(make_source(f"dv://127.0.0.1:{free_port()}"), once=True).start()


THEIR_DATAGRAMS = """
import sys
import faery, numpy as np
given = np.load(sys.argv[2])
rows = np.empty(len(given), faery.EVENTS_DTYPE)
for k, name in enumerate(rows.dtype.names):
    rows[name] = given[:, k]
faery.events_stream_from_array(rows, (346, 260)).to_udp(("127.0.0.1", int(sys.argv[1])))
"""


def test_datagrams_of_faery_arrive(path):
    pytest.importorskip("faery")
    port, events = free_port(socket.SOCK_DGRAM), some_events()
    feed = Feed(make_source(f"udp://127.0.0.1:{port}?format=faery"), size=SIZE)
    feed.start()
    try:
        sender = start(THEIR_DATAGRAMS, port, path)
        assert collected(feed, events.count) == events
        sender.communicate()
    finally:
        feed.stop()


def test_what_is_published_on_zenoh_arrives():
    place, events = f"tcp/127.0.0.1:{free_port()}", some_events()
    feed = Feed(make_source(f"zenoh://evslip/test/events?listen={place}"))
    feed.start()
    try:
        with make_target(f"zenoh://evslip/test/events?connect={place}", SIZE) as target:
            found: list[Events] = []
            ready = threading.Event()
            early = events.replace(t_us=events.t_us - 1_000_000).select(slice(1))

            def greet() -> None:  # until the two have found each other
                while not ready.is_set():
                    target.send(early.select(slice(0)), int(early.t_us[0]))
                    time.sleep(0.02)

            greeting = threading.Thread(target=greet)
            greeting.start()
            wait_for(lambda: feed.size is not None)
            ready.set()
            greeting.join()
            target.send(events, int(events.t_us[-1]))
            found.append(collected(feed, events.count))
        assert found[0] == events
        assert feed.size == SIZE and feed.counters.lost == 0
    finally:
        feed.stop()


def test_without_a_camera_one_line_says_so():
    pytest.importorskip("neuromorphic_drivers")
    with pytest.raises(Unreachable, match=r"no camera can be opened.*expected one on USB"):
        Feed(make_source("usb://"), once=True).start()


def wait_for(is_done, timeout_s: float = 8.0) -> None:
    end_s = time.monotonic() + timeout_s
    while not is_done():
        assert time.monotonic() < end_s
        time.sleep(0.002)
