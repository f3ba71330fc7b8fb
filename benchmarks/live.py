"""Rate, loss and delay of the answers of `evslip live`, with a sender in a process of its own.

python benchmarks/live.py [--rate 5e6] [--seconds 30] [--hop-s 0.001] [--source dv://127.0.0.1:7790]
                         [--records FILE ... | --cost]

Sends noise at a rate all over the sensor for some seconds by UDP to this machine, as evslip's datagrams. Prints what
was reached: events a second, what was lost and said to be, answers a second, skipped answers, and the delay of answers.
--source takes another transport, --target where the two have different addresses: dv:// is the network stream of
dv-processing, whose server the sender is.

With records it sends these instead, at their own pace, and measures alarms by the event that causes them: `detect` with
an answer every hop finds the first answers that say slip. The newest event before such a moment is the cause. The delay
is from when that event happens, at the pace of the record, to when the line of JSON with an alarm is read.

With --cost it sends nothing: it prints the processor time of an answer, whole windows beside rolling ones, which says
what a machine can do that is busy with other work at the moment.
"""

import argparse
import json
import resource
import subprocess
import sys
import time
from collections.abc import Iterator

import numpy as np

SIZE = (346, 260)
TICK_S = 0.001
MODEL = "default-complex"
"""The detector that is asked: one whose answers come from what has changed."""


def wait_for_word() -> None:
    """Say that the target is open, and wait until the listener is there: a server has to be there before it."""
    print("ready", flush=True)
    sys.stdin.readline()


def send(target_address: str, rate: float, seconds: float) -> None:
    """Send noise at a rate."""
    from evslip.events.stream import Events
    from evslip.exchange.live import make_target

    rng, number = np.random.default_rng(0), round(rate * TICK_S)
    offsets = np.sort(rng.integers(0, round(TICK_S * 1e6), number))
    x, y = rng.integers(0, SIZE[0], number, np.uint16), rng.integers(0, SIZE[1], number, np.uint16)
    p, sent, behind_s = x % 2 == 0, 0, 0.0
    with make_target(target_address, SIZE) as target:
        wait_for_word()
        start_s, start_cpu_s = time.monotonic(), time.process_time()
        for tick in range(round(seconds / TICK_S)):
            due_s = start_s + (tick + 1) * TICK_S
            now_s = time.monotonic()
            behind_s = max(behind_s, now_s - due_s)
            time.sleep(max(due_s - now_s, 0))
            base_us = round(tick * TICK_S * 1e6)
            target.send(Events(base_us + offsets, x, y, p), base_us + 1000)
            sent += number
    taken_s, cpu_s = time.monotonic() - start_s, time.process_time() - start_cpu_s
    print(json.dumps({"sent": sent, "sent_hz": sent / taken_s, "behind_ms": behind_s * 1e3, "cpu_s": cpu_s}))


def noise(rng: np.random.Generator, start_us: int, length_us: int, rate: float):
    """Events all over the sensor."""
    from evslip.events.stream import Events

    number = round(rate * length_us / 1e6)
    t_us = np.sort(rng.integers(0, length_us, number)) + start_us
    x, y = rng.integers(0, SIZE[0], number, np.uint16), rng.integers(0, SIZE[1], number, np.uint16)
    return Events(t_us, x, y, rng.integers(0, 2, number) == 1)


def measure_cost(hop_s: float) -> None:
    """Print the processor time of an answer, without that of reading the network."""
    import torch

    from evslip.learn.streaming.stream import Detector

    torch.set_num_threads(1)
    print("| million events/s | answered at once | whole windows, ms | rolling, ms |\n|---|---|---|---|")
    for rate in (0.3e6, 1e6, 5e6):
        for at_once in (1, 4):
            rng, found = np.random.default_rng(0), []
            step_us = round(at_once * hop_s * 1e6)
            for rolling in (False, True):
                detector = Detector(MODEL, hop_s=hop_s, rolling=rolling)
                detector.follow(noise(rng, 0, 200_000, rate), 200_000, newest=1)
                pieces = [noise(rng, 200_001 + i * step_us, step_us, rate) for i in range(20)]
                costs = []
                for piece in pieces:
                    began_s = time.thread_time()
                    answers = len(detector.follow(piece).t_us)
                    costs.append((time.thread_time() - began_s) / max(answers, 1))
                found.append(np.median(costs) * 1e3)
            print(f"| {rate / 1e6:g} | {at_once} | {found[0]:.2f} | {found[1]:.2f} |", flush=True)


def send_record(target_address: str, path: str) -> None:
    """Send a record at its own pace."""
    from evslip.data.record_file import open_recording
    from evslip.exchange.live import make_target
    from evslip.exchange.live.pacing import Pace

    record, _ = open_recording(path)
    pace, behind_s = Pace(), 0.0
    with make_target(target_address, record.size) as target:
        wait_for_word()
        for piece, until_us in pace.slices(lambda: open_recording(path)[1], path):
            ahead_s = pace.due_s(until_us) - time.monotonic()
            behind_s = max(behind_s, -ahead_s)
            time.sleep(max(ahead_s, 0))
            target.send(piece, until_us)
    print(json.dumps({"start_s": pace.start_s, "start_us": pace.start_us, "behind_ms": behind_s * 1e3}))


def causes(path: str, hop_s: float) -> list[int]:
    """Times of the newest events before the moments at which `detect` begins to say slip."""
    from evslip.data.record_file import open_recording
    from evslip.events.stream import concatenate
    from evslip.learn.streaming.stream import detect

    record, parts = open_recording(path)
    events = concatenate(list(parts))
    found = detect(MODEL, events, record.size, hop_s=hop_s)
    slips = found.p_slip >= found.threshold
    begins = found.t_us[slips & ~np.concatenate([[False], slips[:-1]])]
    return events.t_us[np.searchsorted(events.t_us, begins) - 1].tolist()


def start(options: list[str]) -> subprocess.Popen:
    """A sender whose target is open, and that waits for a word."""
    command = [sys.executable, __file__, "--send", *options]
    sending = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert sending.stdout is not None
    if not sending.stdout.readline():
        sys.exit("the sender has ended before it began")
    return sending


def hear(source: str, hop_s: float) -> subprocess.Popen:
    """`evslip live`, listening."""
    words = ["-m", "evslip", "live", source, "--model", MODEL, "--json", "--once", "--hop-s", str(hop_s)]
    hearing = subprocess.Popen([sys.executable, *words], stdout=subprocess.PIPE, text=True)
    assert hearing.stdout is not None
    for line in hearing.stdout:  # with the first status it listens; a note may come before
        if "status" in json.loads(line):
            return hearing
    sys.exit("evslip live has ended before it listened")


def rows_of(hearing: subprocess.Popen, sending: subprocess.Popen) -> Iterator[tuple[dict, float]]:
    """Lines that the listener prints once the sender has got its word, with the times when they are read."""
    assert sending.stdin is not None and hearing.stdout is not None
    sending.stdin.write("\n")
    sending.stdin.flush()
    for line in hearing.stdout:
        yield json.loads(line), time.monotonic()
    hearing.wait()


def measure_alarms(records: list[str], hop_s: float, source: str, target: str) -> None:
    """Print the delay of alarms after the events that cause them."""
    delays, unheard = [], 0
    for path in records:
        expected, alarms, counters = causes(path, hop_s), [], {}
        sending = start(["--records", path, "--target", target])
        for row, now_s in rows_of(hear(source, hop_s), sending):
            if row.get("alarm"):
                alarms.append((row["t_us"], now_s))
            counters = row.get("status", counters)
        sent = json.loads(sending.communicate()[0])
        for t_us, after in zip(expected, [*expected[1:], sys.maxsize], strict=True):
            heard = [now_s for alarm_us, now_s in alarms if t_us < alarm_us <= after]
            unheard += not heard
            delays += [(now_s - sent["start_s"]) * 1e3 - (t_us - sent["start_us"]) / 1e3 for now_s in heard[:1]]
        print(f"{path}: {len(expected)} causes, {len(alarms)} alarms, {counters['answers']:,} answers,", end=" ")
        print(f"{counters['skipped']:,} skipped, {counters['lost']} lost, sender {sent['behind_ms']:.1f} ms behind")
    print(f"alarms heard {len(delays)}, causes without one before the next {unheard}")
    if delays:
        quartiles = np.percentile(delays, [50, 90, 100])
        print("alarm after its cause: median {:.1f} ms, 90 % {:.1f} ms, most {:.1f} ms".format(*quartiles))


def measure_rate(rate: float, seconds: float, hop_s: float, source: str, target: str) -> None:
    """Print how much of noise arrives, and how late it is answered."""
    sending = start(["--rate", str(rate), "--seconds", str(seconds), "--target", target])
    delays, counters = [], {}
    for row, _ in rows_of(hear(source, hop_s), sending):
        if "delay_ms" in row:
            delays.append(row["delay_ms"])
        counters = row.get("status", counters)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)  # of the receiver alone: the sender has not been waited for
    sent = json.loads(sending.communicate()[0])
    unsaid = sent["sent"] - counters["received"] - (counters["lost"] or 0)
    print(f"sent {sent['sent']:,} events, {sent['sent_hz'] / 1e6:.2f} million a second (asked {rate / 1e6:g})", end="")
    print(f", at most {sent['behind_ms']:.0f} ms behind; processor time of the sender {sent['cpu_s']:.1f} s")
    print(f"received {counters['received']:,}, lost and said {counters['lost']}, lost unsaid {unsaid:,}")
    print(f"dropped under overload {counters['dropped']:,}, late {counters['late']:,}")
    print(f"answers {counters['answers']:,} ({len(delays) / seconds:.0f} a second), skipped {counters['skipped']:,}")
    print(f"processor time of the receiver, start included: {used.ru_utime + used.ru_stime:.1f} s")
    if delays:
        quartiles = np.percentile(delays, [50, 90, 99, 100])
        print("delay of an answer: median {:.1f} ms, 90 % {:.1f} ms, 99 % {:.1f} ms, most {:.1f} ms".format(*quartiles))


def main() -> None:
    """Measure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rate", type=float, default=5e6)
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--hop-s", type=float, default=0.001)
    parser.add_argument("--source", default="udp://127.0.0.1:7790")
    parser.add_argument("--target", help="default: as the source; of noise by UDP in datagrams of 32,768 bytes")
    parser.add_argument("--send", action="store_true")
    parser.add_argument("--records", nargs="+", default=[])
    parser.add_argument("--cost", action="store_true")
    given = parser.parse_args()
    if given.cost:
        measure_cost(given.hop_s)
    elif given.send and given.records:
        send_record(given.target, given.records[0])
    elif given.send:
        send(given.target, given.rate, given.seconds)
    elif given.records:
        measure_alarms(given.records, given.hop_s, given.source, given.target or given.source)
    else:
        size = "?bytes=32768" if given.source.startswith("udp://") else ""
        measure_rate(given.rate, given.seconds, given.hop_s, given.source, given.target or given.source + size)


if __name__ == "__main__":
    main()
