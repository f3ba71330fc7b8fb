"""Seconds, events and bytes a sample, by stage.

python benchmarks/generate.py [--preset simple] [--count 16] [--workers 2]
"""

import argparse
import tempfile
import time

import numpy as np

import evslip
from evslip.generation import STAGES


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--preset", default="simple")
    parser.add_argument("--count", type=int, default=16)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as warm_up:
        start = time.perf_counter()
        evslip.generate(options.preset, warm_up, 1, workers=1)
        print(f"first sample, with compilation where caches are cold: {time.perf_counter() - start:.1f} s")
    with tempfile.TemporaryDirectory() as folder:
        summary = evslip.generate(options.preset, folder, options.count, workers=options.workers)
        frames = [record.stats["frames"] for record in evslip.open_dataset(folder)]
    made = summary.made
    print(f"{options.preset}, {len(made)} samples, {options.workers} workers")
    print(f"{'wall seconds a sample':28} {summary.seconds / len(made):8.2f}")
    for stage in STAGES:
        print(f"{stage + ', CPU seconds':28} {np.mean([m.seconds[stage] for m in made]):8.2f}")
    events = np.array([m.entry["events"] for m in made])
    size = np.array([m.entry["bytes"] for m in made])
    print(f"{'frames a sample':28} {np.mean(frames):8.0f}")
    print(f"{'events a sample':28} {events.mean():8,.0f}")
    print(f"{'megabytes a sample':28} {size.mean() / 1e6:8.2f}")
    print(f"{'bytes an event':28} {size.sum() / max(1, events.sum()):8.2f}")


if __name__ == "__main__":
    main()
