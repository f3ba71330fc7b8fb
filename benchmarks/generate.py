"""Seconds, events and bytes a sample, by stage; and the memory of a worker.

python benchmarks/generate.py [--preset simple] [--count 16] [--workers 2] [--memory 500] [--books 100000]

With --memory so many samples are made in this process instead, and its resident memory is watched. With --books the
folder of so many samples is made up of empty files, and the time is taken until a run knows what is missing.
"""

import argparse
import json
import resource
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

import evslip
from evslip.config.loading import dump_config
from evslip.data import building, dataset, layout
from evslip.data.journal import Entry, Journal, encode
from evslip.generation.generate import STAGES, Job, make_sample
from evslip.generation.runners.attempts import attempt, give_back_memory
from evslip.generation.runners.local import TASKS_PER_WORKER

WARM = 20
"""Samples after which a worker has met all kinds of work, and its memory should stay what it is."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--preset", default="simple", help="a preset or a TOML file")
    parser.add_argument("--count", type=int, default=16)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--memory", type=int, default=0, metavar="COUNT")
    parser.add_argument("--books", type=int, default=0, metavar="COUNT")
    options = parser.parse_args()
    if options.memory:
        return memory(options.preset, options.memory)
    if options.books:
        return books(options.books)
    with tempfile.TemporaryDirectory() as warm_up:
        start = time.perf_counter()
        evslip.generate(options.preset, warm_up, 1, workers=1)
        print(f"first sample, with compilation where caches are cold: {time.perf_counter() - start:.1f} s")
    with tempfile.TemporaryDirectory() as folder:
        summary = evslip.generate(options.preset, folder, options.count, workers=options.workers)
        frames = [record.stats["frames"] for record in evslip.open_dataset(folder)]
        files = sum(path.is_file() for path in Path(folder).rglob("*"))
    made = summary.made
    print(f"{options.preset}, {len(made)} samples, {options.workers} workers")
    print(f"{'wall seconds a sample':28} {summary.seconds / len(made):8.2f}")
    for stage in STAGES:
        print(f"{stage + ', CPU seconds':28} {np.mean([m.seconds[stage] for m in made]):8.2f}")
    print(f"{'sum, CPU seconds':28} {np.mean([sum(m.seconds.values()) for m in made]):8.2f}")
    events = np.array([m.entry["events"] for m in made])
    size = np.array([m.entry["bytes"] for m in made])
    print(f"{'frames a sample':28} {np.mean(frames):8.0f}")
    print(f"{'events a sample':28} {events.mean():8,.0f}")
    print(f"{'megabytes a sample':28} {size.mean() / 1e6:8.2f}")
    print(f"{'bytes an event':28} {size.sum() / max(1, events.sum()):8.2f}")
    print(f"{'files in the folder':28} {files:8}")
    return None


def memory(preset: str, count: int) -> None:
    """Print the resident memory of one worker over `count` samples."""
    config = evslip.load_config(preset)
    seen = []
    with tempfile.TemporaryDirectory() as folder:
        text = dump_config(config)
        building.create(Path(folder), text)
        for index in range(count):
            is_done, what = attempt(make_sample, Job(folder, text, "train", index, json.dumps({})))
            if not is_done:
                raise SystemExit(str(what))
            seen.append(resident_mb())
            if index + 1 in (WARM, count) or (index + 1) % max(1, count // 10) == 0:
                print(f"after {index + 1:4} samples {seen[-1]:6.1f} MB", flush=True)
    rest = np.array(seen[WARM:])
    halves = np.median(rest[: len(rest) // 2]), np.median(rest[len(rest) // 2 :])
    print(f"after the first {WARM}: {rest.min():.1f} to {rest.max():.1f} MB; medians of the halves differ by ", end="")
    print(f"{halves[1] - halves[0]:+.1f} MB; peak {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3:.0f} MB")


def books(count: int) -> None:
    """Print what it takes to read the journals of `count` samples and to look at every file."""
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        for index in range(count):
            if index % TASKS_PER_WORKER == 0:
                path = Journal(root / layout.JOURNAL).path
                path.parent.mkdir(parents=True, exist_ok=True)
            entry = Entry(
                name=f"train/{index:07d}",
                split="train",
                index=index,
                kind="simulated",
                sha256=f"{index:064x}",
                bytes=0,
                events=2_000_000,
                label="slip",
            )
            with path.open("ab") as file:
                file.write(encode(entry))
            record = layout.sample_path(root, "train", index)
            record.parent.mkdir(parents=True, exist_ok=True)
            record.touch()
        sizes = Counter(path.parent for path in root.rglob("*") if path.is_file())
        print(f"{count:,} samples, {sum(sizes.values()):,} files, at most {max(sizes.values()):,} in a folder")
        for name, indices in (("all", None), ("one part of a hundred", range(count // 100))):
            give_back_memory()
            before, start, begun = resident_mb(), time.perf_counter(), time.process_time()
            there = dataset.finished(root, "train", indices)
            seconds, busy = time.perf_counter() - start, time.process_time() - begun
            print(
                f"{name}: {len(there):,} found in {seconds:.1f} s, {busy:.1f} CPU-s; {resident_mb() - before:+.0f} MB"
            )
            del there


def resident_mb() -> float:
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / 1e6


if __name__ == "__main__":
    main()
