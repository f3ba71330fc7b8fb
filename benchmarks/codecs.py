"""How fast files of events are written and read, how large they are, and what memory a conversion takes.

python benchmarks/codecs.py --count 4000000
"""

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from evslip.codecs import known_suffixes, read_events
from evslip.codecs.writers import writing
from evslip.events.stream import Events

TEXT = {".csv", ".txt"}
"""Written with a tenth of the events."""
WHOLE = {".npz", ".mat"}
"""Kept in memory whole."""
SIZE = (346, 260)
PIECE = 1 << 18
_CONVERT = """
import sys
from evslip.exchange.format_to_format import convert_format
convert_format(*sys.argv[1:])
print(next(int(line.split()[1]) / 1024 for line in open("/proc/self/status") if line.startswith("VmHWM")))
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=4_000_000)
    parser.add_argument("--repeats", type=int, default=3)
    arguments = parser.parse_args()
    suffixes = [suffix for suffix in known_suffixes(writing=True) if suffix != ".hdf5"]
    print("| format | bytes an event | write, Mevents/s | read, Mevents/s | memory of a conversion, MB: once, 4 x |")
    print("|---|---|---|---|---|")
    for suffix in [*suffixes, ".evt2.raw"]:
        count = arguments.count // (10 if suffix in TEXT else 1)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"a{suffix}"
            events = stream(count, 0)
            times = [timed(path, events) for _ in range(arguments.repeats)]
            write, read = (count / min(column) / 1e6 for column in zip(*times, strict=True))
            size = path.stat().st_size / count
            del events
            memory = "whole" if suffix in WHOLE else f"{peak(path, count, 1):.0f}, {peak(path, count, 4):.0f}"
            print(f"| {suffix} | {size:.2f} | {write:.1f} | {read:.1f} | {memory} |", flush=True)


def stream(count: int, number: int) -> Events:
    """Events at random pixels of a DAVIS346, 1 million a second; `number` of the stretch of so many."""
    rng = np.random.default_rng(number)
    x, y = (rng.integers(0, side, count, np.uint16) for side in SIZE)
    return Events(np.sort(rng.integers(0, count, count)) + number * count, x, y, rng.random(count) < 0.5)


def timed(path: Path, events: Events) -> tuple[float, float]:
    """Processor seconds to write and to read."""
    start = time.process_time()
    with writing(path, SIZE) as push:
        push(events)
    written = time.process_time()
    read = read_events(path)
    end = time.process_time()
    assert all(np.array_equal(one, other) for one, other in zip(events.columns, read.columns, strict=True))
    return written - start, end - written


def peak(path: Path, count: int, times: int) -> float:
    """Most memory, in MB, of a process that converts a file of `times` stretches of events into the same format."""
    long, out = path.with_name(f"long-{path.name}"), path.with_name(f"out-{path.name}")
    with writing(long, SIZE) as push:
        for number in range(times):
            part = stream(count, number)
            for start in range(0, count, PIECE):
                push(part.select(slice(start, start + PIECE)))
    command = [sys.executable, "-c", _CONVERT, str(long), str(out)]
    return float(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


if __name__ == "__main__":
    main()
