"""How fast files of events are written and read, and how large they are.

python benchmarks/codecs.py --count 4000000
"""

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

from evslip.codecs import FORMATS, READ_ONLY, read_events, write_events
from evslip.events.stream import Events

TEXT = {".csv", ".txt"}
"""Written with a tenth of the events."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=4_000_000)
    parser.add_argument("--repeats", type=int, default=3)
    arguments = parser.parse_args()
    suffixes = [suffix for suffix, name in FORMATS.items() if name not in READ_ONLY and suffix != ".hdf5"]
    for suffix in [*suffixes, ".evt2.raw"]:
        events = stream(arguments.count // (10 if suffix in TEXT else 1))
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"a{suffix}"
            times = [timed(path, events) for _ in range(arguments.repeats)]
            write, read = (events.count / min(column) / 1e6 for column in zip(*times, strict=True))
            print(f"| {suffix} | {path.stat().st_size / events.count:.2f} | {write:.1f} | {read:.1f} |", flush=True)


def stream(count: int) -> Events:
    """Events at random pixels of a DAVIS346, 1 million a second."""
    rng = np.random.default_rng(0)
    x, y = (rng.integers(0, side, count, np.uint16) for side in (346, 260))
    return Events(np.sort(rng.integers(0, count, count)), x, y, rng.random(count) < 0.5)


def timed(path: Path, events: Events) -> tuple[float, float]:
    """Seconds to write and to read."""
    start = time.perf_counter()
    write_events(path, events, (346, 260))
    written = time.perf_counter()
    read = read_events(path)
    end = time.perf_counter()
    assert all(np.array_equal(one, other) for one, other in zip(events[:4], read[:4], strict=True))
    return written - start, end - written


if __name__ == "__main__":
    main()
