"""Rate, loss and delay of the answers of `evslip live`, with a sender in a process of its own.

python benchmarks/live.py [--rate 5e6] [--seconds 30] [--hop-s 0.001]

Sends noise at a rate all over the sensor for some seconds by UDP to this machine, as evslip's datagrams. Prints what
was reached: events a second, what was lost and said to be, answers a second, skipped answers, and the delay of answers.
"""

import argparse
import json
import subprocess
import sys
import time

import numpy as np

SIZE = (346, 260)
TICK_S = 0.001


def send(port: int, rate: float, seconds: float) -> None:
    """Send noise at a rate."""
    from evslip.events.stream import Events
    from evslip.exchange.live import make_target

    rng, number = np.random.default_rng(0), round(rate * TICK_S)
    offsets = np.sort(rng.integers(0, round(TICK_S * 1e6), number))
    x, y = rng.integers(0, SIZE[0], number, np.uint16), rng.integers(0, SIZE[1], number, np.uint16)
    p, sent, behind_s = x % 2 == 0, 0, 0.0
    with make_target(f"udp://127.0.0.1:{port}?bytes=32768", SIZE) as target:
        start_s = time.monotonic()
        for tick in range(round(seconds / TICK_S)):
            due_s = start_s + (tick + 1) * TICK_S
            now_s = time.monotonic()
            behind_s = max(behind_s, now_s - due_s)
            time.sleep(max(due_s - now_s, 0))
            base_us = round(tick * TICK_S * 1e6)
            target.send(Events(base_us + offsets, x, y, p), base_us + 1000)
            sent += number
    taken_s = time.monotonic() - start_s
    print(json.dumps({"sent": sent, "sent_hz": sent / taken_s, "behind_ms": behind_s * 1e3}))


def main() -> None:
    """Measure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rate", type=float, default=5e6)
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--hop-s", type=float, default=0.001)
    parser.add_argument("--port", type=int, default=7790)
    parser.add_argument("--send", action="store_true")
    given = parser.parse_args()
    if given.send:
        send(given.port, given.rate, given.seconds)
        return
    address = f"udp://127.0.0.1:{given.port}"
    words = ["-m", "evslip", "live", address, "--json", "--once", "--hop-s", str(given.hop_s)]
    hearing = subprocess.Popen([sys.executable, *words], stdout=subprocess.PIPE, text=True)
    assert hearing.stdout is not None
    hearing.stdout.readline()  # the first status: it listens
    options = ["--send", "--rate", str(given.rate), "--seconds", str(given.seconds), "--port", str(given.port)]
    sending = subprocess.Popen([sys.executable, __file__, *options], stdout=subprocess.PIPE, text=True)
    delays, counters = [], {}
    for line in hearing.stdout:
        row = json.loads(line)
        if "delay_ms" in row:
            delays.append(row["delay_ms"])
        counters = row.get("status", counters)
    sent = json.loads(sending.communicate()[0])
    unsaid = sent["sent"] - counters["received"] - counters["lost"]
    print(f"sent {sent['sent']:,} events, {sent['sent_hz'] / 1e6:.2f} million a second (asked {given.rate / 1e6:g})")
    print(f"received {counters['received']:,}, lost and said {counters['lost']:,}, lost unsaid {unsaid:,}")
    print(f"dropped under overload {counters['dropped']:,}, late {counters['late']:,}")
    print(
        f"answers {counters['answers']:,} ({len(delays) / given.seconds:.0f} a second), skipped {counters['skipped']:,}"
    )
    if delays:
        quartiles = np.percentile(delays, [50, 90, 99])
        print("delay of an answer: median {:.1f} ms, 90 % {:.1f} ms, 99 % {:.1f} ms".format(*quartiles))


if __name__ == "__main__":
    main()
