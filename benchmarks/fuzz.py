"""Damaged and hostile files: each must be refused in one line or give valid data; never crash, hang, or use over 1 GB.

python benchmarks/fuzz.py --count 1000 [--only structures]

Mutates small files of every format: bytes changed, runs copied, zeroed, cut out, the end cut off; half of the changes
near the beginning. Then records, windows and models whose parts are exchanged (`fuzz_structures`), used as verbs use
them. Each kind is read in a process of its own. Prints a table; exit code 1 if a process died, as at a traceback, a
file took over 20 s, or a process grew beyond 1 GB.
"""

import argparse
import contextlib
import os
import shutil
import signal
import struct
import sys
import tempfile
import traceback
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
from fuzz_structures import structures, write_hostile

from evslip.codecs import format_of, known_suffixes, raw_source, read_events, write_events
from evslip.data import record_file
from evslip.data.record import Record
from evslip.data.record_file import read_recording
from evslip.events.stream import Events
from evslip.utils.errors import EvslipError

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))
from foreign_files import aedat2  # pyright: ignore[reportMissingImports]
from ros_bags import SUFFIXES, arrays, packets  # pyright: ignore[reportMissingImports]
from sample_records import random_events, simulated  # pyright: ignore[reportMissingImports]

SECONDS, MEGABYTES = 20, 1000
Trial = Callable[[Path, np.random.Generator], str]
"""Makes a hostile file under the name given, and says what became of it."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", choices=("bytes", "structures"))
    arguments = parser.parse_args()
    failed = False
    print("| file | mutations | refused | equal | other valid events | died | hung | peak, MB |", flush=True)
    print("|---|---|---|---|---|---|---|---|", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        trials: list[tuple[Path, Trial]] = []
        if arguments.only != "structures":
            trials += [(path, damage(path)) for path in whole_files(Path(folder, "bytes"))]
        if arguments.only != "bytes":
            trials += [(path, exchange(path, use)) for path, use in hostile_files(Path(folder, "structures"))]
        for path, trial in trials:
            results, peak = fuzz(path, trial, arguments.count, arguments.seed)
            failed |= results["died"] + results["hung"] > 0 or peak > MEGABYTES
            columns = (results[name] for name in ("refused", "equal", "other", "died", "hung"))
            print(f"| {path.name} | {arguments.count} | {' | '.join(map(str, columns))} | {peak:.0f} |", flush=True)
    sys.exit(failed)


def damage(path: Path) -> "Trial":
    """Bytes are changed; what is read must be valid events."""
    whole, expected = path.read_bytes(), read_events(path)

    def trial(damaged: Path, rng: np.random.Generator) -> str:
        damaged.write_bytes(mutated(whole, rng))
        return outcome(damaged, expected)

    return trial


def exchange(path: Path, use: Callable[[Path], object]) -> "Trial":
    """Parts are exchanged; what is done with the file must end, or end with one line."""

    def trial(damaged: Path, rng: np.random.Generator) -> str:
        write_hostile(path, damaged, rng)
        try:
            use(damaged)
        except EvslipError as error:
            assert "\n" not in str(error) and len(str(error)) < 1600, error
            return "refused"
        return "other"

    return trial


def hostile_files(folder: Path) -> list[tuple[Path, Callable[[Path], object]]]:
    """A file of each structure, and what is done with it."""
    events = random_events(np.random.default_rng(0), 2000, labelled=False)
    return structures(folder, Record(kind="recording", name="a", size=(40, 30), events=events), simulated())


def whole_files(folder: Path) -> list[Path]:
    """A file of each format."""
    folder.mkdir()
    events = random_events(np.random.default_rng(0), 2000, labelled=False)
    names = [f"a{suffix}" for suffix in known_suffixes(writing=True) if suffix != ".hdf5"]
    for name in (*names, "a.evt2.raw"):
        write_events(folder / name, events, (40, 30))
    record_file.write(folder / "record.h5", simulated())
    (folder / "a.aedat").write_bytes(aedat2(events, (346, 260)))
    arrays(folder / "a.bag", events, (40, 30), [np.zeros((30, 40), np.uint8)])
    for name, packed in {**{f"packets{suffix}": "" for suffix in SUFFIXES}, "packed.mcap": "storage"}.items():
        made = packets(folder / name, events, (40, 30), "evt3", packed=packed)
        if made.parent != folder:  # one of the files of a folder
            made.rename(folder / name)
            shutil.rmtree(made.parent)
    return sorted(folder.iterdir())


def mutated(whole: bytes, rng: np.random.Generator) -> bytes:
    """The file with a few faults."""
    data = np.frombuffer(whole, np.uint8).copy()
    reach = len(data) if rng.random() < 0.5 else min(len(data), 600)
    for _ in range(rng.integers(1, 5)):
        place, length = int(rng.integers(0, reach)), int(rng.integers(1, 40))
        kind = rng.integers(0, 5)
        part = slice(place, min(place + length, len(data)))
        if kind == 0:
            data[part.start] = rng.integers(0, 256)
        elif kind == 1:
            data[part] = rng.choice(np.array([0, 1, 127, 128, 255], np.uint8))
        elif kind == 2 and place + 8 < len(data):
            number = int(rng.choice(np.array([2**31 - 1, 2**32 - 1, 2**40, 2**62, 2**63 - 1], np.int64)))
            data[place : place + 8] = np.frombuffer(struct.pack("<q", number), np.uint8)
        elif kind == 3:
            data = np.delete(data, part)
        else:
            data = np.insert(data, place, data[part])
        reach = max(1, min(reach, len(data)))
    return data.tobytes()[: None if rng.random() < 0.8 else int(rng.integers(0, len(data) + 1))]


def fuzz(path: Path, trial: "Trial", count: int, seed: int) -> tuple[Counter[str], float]:
    """What became of the mutations, and the largest memory of the processes in MB."""
    results: Counter[str] = Counter()
    peak, done = 0.0, 0
    while done < count:
        reading, writing = os.pipe()
        child = os.fork()
        if child == 0:
            os.close(reading)
            try:
                _child(path, trial, range(done, count), seed, writing)
            except BaseException:  # the parent counts it as a death; nothing may unwind beyond, and remove the files
                traceback.print_exc()
                os._exit(3)
        os.close(writing)
        with os.fdopen(reading) as lines:
            said = [line.strip() for line in lines]
        _, status, usage = os.wait4(child, 0)
        peak = max(peak, usage.ru_maxrss / 1024)
        results.update(said)
        done += len(said)
        if status != 0 and done < count:
            results["hung" if os.WTERMSIG(status) == signal.SIGALRM else "died"] += 1
            done += 1
    return results, peak


def _child(path: Path, trial: "Trial", numbers: range, seed: int, pipe: int) -> None:
    damaged = path.with_name(f"damaged-{path.name}")
    for number in numbers:
        signal.alarm(SECONDS)
        said = trial(damaged, np.random.default_rng([seed, number]))
        signal.alarm(0)
        os.write(pipe, f"{said}\n".encode())
    damaged.unlink()
    os._exit(0)


def outcome(path: Path, expected: Events) -> str:
    """What reading gives; anything but an EvslipError ends the process."""
    with contextlib.suppress(EvslipError):
        for _ in getattr(format_of(path).codec, "frames", lambda _: ())(path):
            pass
    with contextlib.suppress(EvslipError):
        for _ in raw_source(path).parts:
            pass
    try:
        read = read_recording(path).events
    except EvslipError:
        return "refused"
    assert (read.t_us[1:] >= read.t_us[:-1]).all()
    same = all(np.array_equal(a, b) for a, b in zip(read.columns, expected.columns, strict=True))
    return "equal" if same else "other"


if __name__ == "__main__":
    main()
