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
from evslip.utils.errors import ConfigError

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


OUR_SERVER = """
import sys, time
import numpy as np
from evslip.events.stream import Events
from evslip.exchange.live import make_target
port, path = int(sys.argv[1]), sys.argv[2]
t_us, x, y, p = np.load(path).T
events = Events(t_us, x.astype(np.uint16), y.astype(np.uint16), p == 1)
for _ in range(2):
    with make_target(f"dv://127.0.0.1:{port}", (346, 260)) as target:
        print("ready", flush=True)
        sys.stdin.readline()
        still = 0  # a reader that looks whether a server is there, before it reads, is a client too for a moment
        while still < 20:
            time.sleep(0.01)
            still = still + 1 if target.clients == 1 else 0
        target.send(events, 0)
    del target
    print("closed", flush=True)
"""


@pytest.mark.parametrize("reads", [True, False])
def test_a_sender_ends_and_begins_anew_while_a_reader_stays(path, reads: bool):
    # In a process of its own: what the package's destructor waits for would hold the interpreter's lock.
    port, events = free_port(), some_events()
    sender = start(OUR_SERVER, port, path)
    source = make_source(f"dv://127.0.0.1:{port}")
    try:
        for _ in range(2):
            assert said(sender) == "ready"
            source.open()
            say(sender)
            found, end_s = [], time.monotonic() + 10
            while reads and sum(part.count for part in found) < events.count and time.monotonic() < end_s:
                piece = source.read(0.1)
                found += [] if piece is None else [piece.events]
            assert not reads or concatenate(found) == events
            assert said(sender) == "closed"
        sender.communicate(timeout=10)
        assert sender.returncode == 0
    finally:
        source.close()
        sender.kill()
        sender.communicate()


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


def messages_of_ros(events: Events, encoding: str, cut: int = 500) -> list[bytes]:
    """EventPackets in CDR, serialised by rosbags."""
    from evslip.codecs.prophesee import evt3
    from evslip.codecs.ros.definitions import types

    store, encoder, found = types(cdr=True), evt3.Encoder(), []
    made = store.types
    for seq, first in enumerate(range(0, events.count, cut)):
        part = events.select(slice(first, first + cut))
        base_ns = int(part.t_us[0]) * 1000
        if encoding == "evt3":
            content = encoder.encode(part).astype("<u2").view(np.uint8)
        else:
            t_us, x, y, p = (column.astype(np.uint64) for column in part.columns)
            words = (t_us * np.uint64(1000) - np.uint64(base_ns)) | x << np.uint64(32) | y << np.uint64(48)
            content = (words | p << np.uint64(63)).astype("<u8").view(np.uint8)
        stamp = made["builtin_interfaces/msg/Time"](sec=1, nanosec=2)
        header = made["std_msgs/msg/Header"](stamp=stamp, frame_id="camera")
        message = made["event_camera_msgs/msg/EventPacket"](
            header=header, height=SIZE[1], width=SIZE[0], seq=seq, time_base=base_ns, encoding=encoding,
            is_bigendian=False, events=content,
        )  # fmt: skip
        found.append(bytes(store.serialize_cdr(message, "event_camera_msgs/msg/EventPacket")))
    return found


@pytest.mark.parametrize("encoding", ["mono", "evt3"])
def test_a_topic_of_ros_2_over_zenoh_is_heard(encoding: str):
    import zenoh

    pytest.importorskip("rosbags")
    place, events = f"tcp/127.0.0.1:{free_port()}", some_events()
    messages = messages_of_ros(events, encoding)
    feed = Feed(make_source(f"zenoh://0/event_camera/events?format=ros2&listen={place}"))
    feed.start()
    config = zenoh.Config()
    config.insert_json5("connect/endpoints", f'["{place}"]')
    config.insert_json5("scouting/multicast/enabled", "false")
    key = "0/event_camera/events/event_camera_msgs::msg::dds_::EventPacket_/RIHS01_" + 32 * "5e"
    try:
        with zenoh.open(config) as session:
            publisher = session.declare_publisher(key)
            wait_for(lambda: publisher.matching_status.matching)
            for i, message in enumerate(messages):
                if encoding == "evt3" or i not in (3, 4):
                    publisher.put(message, attachment=b"sequence number, time and sender, as rmw_zenoh has them")
            publisher.put(b"no message")
            found = collected(feed, events.count - (1_000 if encoding == "mono" else 0))
            wait_for(lambda: feed.counters.damaged == 1)
        kept = np.arange(events.count) // 500
        expected = events if encoding == "evt3" else events.select((kept != 3) & (kept != 4))
        assert found == expected
        assert feed.size == SIZE
        assert feed.counters.lost_packets == (0 if encoding == "evt3" else 2)
        assert feed.counters.as_json()["lost"] is None
    finally:
        feed.stop()


def test_packets_of_a_publisher_that_begins_anew():
    from evslip.exchange.live.transports.packets import PacketReceiver

    messages = messages_of_ros(some_events(), "mono")
    receiver = PacketReceiver()
    assert receiver.piece(messages[:4], 0.0).restart
    assert not receiver.piece(messages[4:6], 0.0).restart
    again = receiver.piece(messages[:2], 0.0)
    assert again.restart and again.lost_packets == 0 and again.events.count == 1_000


@pytest.mark.parametrize(
    "address, expected",
    [
        ("zenoh://event_camera/events?format=ros2", "zenoh://DOMAIN/TOPIC"),
        ("zenoh://0?format=ros2", "zenoh://DOMAIN/TOPIC"),
        ("zenoh://0/events?format=cdr", "expected evslip or ros2"),
    ],
)
def test_wrong_addresses_of_topics_are_told(address: str, expected: str):
    with pytest.raises(ConfigError, match=expected):
        make_source(address)


def test_without_a_camera_one_line_says_so():
    pytest.importorskip("neuromorphic_drivers")
    with pytest.raises(Unreachable, match=r"no camera can be opened.*expected one on USB"):
        Feed(make_source("usb://"), once=True).start()


def wait_for(is_done, timeout_s: float = 8.0) -> None:
    end_s = time.monotonic() + timeout_s
    while not is_done():
        assert time.monotonic() < end_s
        time.sleep(0.002)
