"""Live sources, with real senders on this machine."""

import dataclasses
import socket
import subprocess
import sys
import time

import numpy as np
import pytest

from evslip.codecs import write_events
from evslip.events.stream import Events, concatenate
from evslip.exchange.live import make_source, make_target
from evslip.exchange.live.backlog import Backlog
from evslip.exchange.live.feed import Feed
from evslip.exchange.live.sender import send_file
from evslip.exchange.live.source import Piece
from evslip.exchange.live.transports.datagrams import Receiver
from evslip.exchange.live.transports.packet import Packer, pack_faery, unpack, unpack_faery
from evslip.utils.errors import ConfigError, DataError
from sample_records import random_events

SIZE = (346, 260)


def some_events(count: int = 20_000, seconds: float = 0.2, start_us: int = 5_000_000) -> Events:
    rng = np.random.default_rng(0)
    t_us = np.sort(rng.integers(0, int(seconds * 1e6), count)) + start_us
    return Events(t_us, rng.integers(0, 346, count, np.uint16), rng.integers(0, 260, count, np.uint16), t_us % 2 == 0)


def free_port(kind: socket.SocketKind = socket.SOCK_DGRAM) -> int:
    with socket.socket(type=kind) as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def collected(feed: Feed, count: int, timeout_s: float = 10.0) -> Events:
    """Events of a feed until there are so many, or the time is over."""
    found, end_s = [], time.monotonic() + timeout_s
    while sum(part.count for part in found) < count and time.monotonic() < end_s:
        found += [piece.events for piece in feed.take(0.05) if piece.events.count]
    return concatenate(found)


@pytest.fixture
def recording(tmp_path):
    path = tmp_path / "some.h5"
    write_events(path, some_events(), SIZE)
    return path


@pytest.mark.parametrize("query", ["", "?format=faery", "?bytes=100"])
def test_what_is_sent_by_udp_arrives(recording, query):
    address = f"udp://127.0.0.1:{free_port()}"
    feed = Feed(make_source(address + (query if "faery" in query else "")), size=SIZE)
    feed.start()
    try:
        sent = send_file(recording, lambda size: make_target(address + query, size))
        assert collected(feed, sent.events) == some_events()
        assert feed.counters.received == sent.events == 20_000
        assert feed.counters.lost == feed.counters.late == feed.counters.damaged == 0
        assert feed.size == SIZE
        assert sent.seconds >= 0.19
    finally:
        feed.stop()


def test_a_file_comes_at_its_own_pace(recording):
    feed = Feed(make_source(str(recording)))
    began_s = time.monotonic()
    feed.start()
    assert collected(feed, 20_000) == some_events()
    assert 0.19 <= time.monotonic() - began_s < 2.0
    while not feed.is_over:
        feed.take(0.01)
    feed.stop()


def test_a_loop_goes_on_in_time(recording):
    address = f"udp://127.0.0.1:{free_port()}"
    feed = Feed(make_source(address), size=SIZE)
    feed.start()
    command = ["stream", recording, address, "--loop", "--speed", "4"]
    sender = subprocess.Popen([sys.executable, "-m", "evslip", *map(str, command)], stdout=subprocess.DEVNULL)
    try:
        events = collected(feed, 50_000)
    finally:
        sender.kill()
        sender.wait()
        feed.stop()
    assert events.count >= 50_000 and feed.counters.restarts == feed.counters.late == 0
    assert (np.diff(events.t_us) >= 0).all()


def test_every_lost_event_is_counted():
    """Datagrams thrown away at random, others out of order: received and lost make up what was sent."""
    port = free_port()
    events, rng = some_events(), np.random.default_rng(1)
    datagrams = Packer(SIZE, 7, 500).pack(events, 0)
    end = Packer(SIZE, 7, 500)
    end._number = events.count
    kept = [datagram for datagram in datagrams if rng.random() < 0.7]
    kept[5], kept[6] = kept[6], kept[5]
    feed = Feed(make_source(f"udp://127.0.0.1:{port}"))
    feed.start()
    expected = sum(found.events.count for found in map(unpack, kept) if found)
    with socket.socket(type=socket.SOCK_DGRAM) as sender:
        first = unpack(datagrams[0])
        assert first is not None
        for datagram in [datagrams[0], *kept, end.end(int(events.t_us[-1])), b"nonsense" * 9]:
            sender.sendto(datagram, ("127.0.0.1", port))
            time.sleep(0.0005)
    end_s = time.monotonic() + 5
    while not feed.counters.damaged and time.monotonic() < end_s:
        feed.take(0.01)
    feed.stop()
    twice = first.events.count if kept[0] == datagrams[0] else 0
    counters = feed.counters
    assert counters.damaged == 1
    assert counters.received == expected + first.events.count
    assert counters.received + counters.lost == events.count + twice * 0 or twice
    assert counters.late <= counters.received - expected + 400


def test_a_sender_that_begins_anew_restarts_the_stream():
    port = free_port()
    feed = Feed(make_source(f"udp://127.0.0.1:{port}"))
    feed.start()
    for start_us in (900_000_000, 1_000_000):
        with make_target(f"udp://127.0.0.1:{port}", SIZE) as target:
            target.send(some_events(10, 0.001, start_us), start_us + 1000)
    pieces, end_s = [], time.monotonic() + 5
    while sum(piece.events.count for piece in pieces) < 20 and time.monotonic() < end_s:
        pieces += feed.take(0.05)
    feed.stop()
    assert [piece.restart for piece in pieces if piece.events.count] == [True, True]
    assert feed.counters.restarts == 1 and feed.counters.late == feed.counters.lost == 0
    assert any("begun anew" in note for note in feed.notes())


def test_of_two_senders_the_one_that_began_last_is_heard_and_the_other_told():
    receiver = Receiver()
    first, second = (Packer(SIZE, stream, 500) for stream in (7, 8))

    def piece(packer: Packer, at_s: float) -> Piece:
        return receiver.piece(packer.pack(some_events(10, 0.001), 6_000_000), at_s)

    assert piece(first, 0.0).restart and not piece(first, 0.1).restart
    assert piece(second, 0.2).restart  # a sender that was started anew
    left_out = piece(first, 0.3)
    assert (left_out.restart, left_out.events.count, left_out.foreign, left_out.lost) == (False, 0, 10, 0)
    assert not piece(second, 0.4).restart
    together = receiver.piece([*second.pack(some_events(10, 0.001), 0), *first.pack(some_events(5, 0.001), 0)], 0.5)
    assert (together.restart, together.events.count, together.foreign, together.lost) == (False, 10, 5, 0)
    again = piece(first, 2.0)  # the other has been silent
    assert again.restart and again.events.count == 10 and again.foreign == 0
    receiver.piece([first.end(6_000_000)], 2.1)
    assert not receiver.piece([second.end(6_000_000)], 2.15).restart  # what ends does not begin
    assert piece(second, 2.2).restart  # the other has said that it is over


def test_a_second_sender_is_told_once():
    port = free_port()
    feed = Feed(make_source(f"udp://127.0.0.1:{port}"))
    feed.start()
    with make_target(f"udp://127.0.0.1:{port}", SIZE) as one, make_target(f"udp://127.0.0.1:{port}", SIZE) as other:
        for k in range(6):
            for number, target in enumerate((one, other)):
                start_us = 5_000_000 + 1000 * k
                target.send(some_events(10, 0.001, start_us), start_us + 1000)
                came, end_s = 20 * k + 10 * (number + 1), time.monotonic() + 5
                while feed.counters.received + feed.counters.foreign < came and time.monotonic() < end_s:
                    feed.take(0.01)
    feed.stop()
    assert feed.counters.restarts == 1 and feed.counters.foreign == 50 and feed.counters.lost == 0
    assert sum("others send to this address" in note for note in feed.notes()) == 1


def test_disorder_and_pixels_beyond_the_sensor_are_dropped_and_counted():
    port = free_port()
    feed = Feed(make_source(f"udp://127.0.0.1:{port}?format=faery"), size=(10, 10))
    feed.start()
    t_us, x = np.array([100, 200, 150, 300, 400]), np.array([1, 2, 3, 40, 5], np.uint16)
    events = Events(t_us, x, x % 10, x > 0)
    with socket.socket(type=socket.SOCK_DGRAM) as sender:
        sender.sendto(pack_faery(events, 1000)[0], ("127.0.0.1", port))
    assert collected(feed, 3).t_us.tolist() == [100, 200, 400]
    feed.stop()
    assert (feed.counters.late, feed.counters.outside, feed.counters.received) == (1, 1, 5)


def test_a_backlog_is_bounded_and_keeps_the_newest():
    backlog = Backlog(100)
    for number in range(10):
        backlog.put(Piece(some_events(30, 0.001, number * 1000), 0.0, restart=number == 0))
    pieces = backlog.take(0.0)
    assert [int(piece.events.t_us[0] // 1000) for piece in pieces] == [7, 8, 9]
    assert backlog.dropped == 210 and pieces[0].restart


def test_what_is_no_datagram_is_refused_without_an_error():
    rng = np.random.default_rng(0)
    good = Packer(SIZE, 1, 1000).pack(some_events(50), 0)[0]
    for _ in range(2000):
        data = bytearray(good)
        data[rng.integers(len(data))] ^= 1 << int(rng.integers(8))
        found = unpack(bytes(data[: rng.integers(len(data) + 1)] if rng.random() < 0.5 else data))
        assert found is None or found.events.count <= 50
        unpack_faery(bytes(data))
    assert unpack(good) is not None


def test_labels_and_long_pauses_survive_packing():
    events = random_events(np.random.default_rng(0), 100, labelled=False)
    events = dataclasses.replace(events, t_us=events.t_us + np.where(np.arange(100) < 50, 0, 2**33))
    found = [unpack(data) for data in Packer(SIZE, 1, 60_000).pack(events, 0)]
    assert concatenate([one.events for one in found if one]) == events


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("dv://127.0.0.1:7?a=b", "a is unknown"),
        ("zenoh://a?b=c", "expected connect or listen"),
        ("http://a:1", "expected a file of events, dv://, udp://"),
        ("udp://127.0.0.1", "expected udp://HOST:PORT"),
        ("udp://127.0.0.1:99999", "1 to 65535"),
        ("udp://127.0.0.1:7?format=xml", "expected evslip or faery"),
        ("udp://127.0.0.1:7?colour=red", "colour is unknown"),
        ("udp://no.such.machine.invalid:7", "is not known"),
    ],
)
def test_wrong_addresses_are_told_in_one_line(address, said):
    with pytest.raises(ConfigError, match=said.replace("?", r"\?")):
        make_source(address)


def test_a_port_in_use_and_a_missing_file_are_told():
    with socket.socket(type=socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        feed = Feed(make_source(f"udp://127.0.0.1:{other.getsockname()[1]}"))
        with pytest.raises(ConfigError, match="cannot be listened to"):
            feed.start()
    with pytest.raises(DataError):
        make_source("missing.h5")
