"""Cost of the first minute: python benchmarks/first_run.py [--preset simple]

Compiling from an empty cache, in a folder of its own: what `evslip warm-up` takes, then the first
and the second sample of `evslip generate`, one each; and, in one process, where the time goes, by module.
"""

import argparse
import collections
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from evslip.config.loading import load_config
from evslip.utils.errors import ConfigError

PROFILE = """
import collections, json, sys, time
from numba.core import event

class Listener(event.Listener):
    stack, seconds, counts = [], collections.Counter(), collections.Counter()

    def on_start(self, event):
        self.stack.append([time.process_time(), 0.0])

    def on_end(self, event):
        begun, inside = self.stack.pop()
        whole, module = time.process_time() - begun, event.data["dispatcher"].py_func.__module__
        self.seconds[module] += whole - inside
        self.counts[module] += 1
        if self.stack:
            self.stack[-1][1] += whole

event.register("numba:compile", Listener())
import evslip
from evslip.generation.generate import make_record
make_record(evslip.draw(evslip.load_config(sys.argv[1]), 0))
print(json.dumps([[m, Listener.seconds[m], Listener.counts[m]] for m in Listener.seconds]))
"""


def spent(words: list[str], environment: dict[str, str]) -> tuple[float, float, str]:
    """Seconds by the clock, processor seconds of it and all its children, and what a command printed."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run([sys.executable, *words], env=environment, check=True, capture_output=True, text=True)
    clock, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    return clock, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, done.stdout


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--preset", default="simple")
    preset = parser.parse_args().preset
    try:
        load_config(preset)
    except ConfigError as error:
        parser.error(str(error))
    print("| | by the clock, s | CPU-s |\n|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        environment, data = {**os.environ, "NUMBA_CACHE_DIR": folder}, str(Path(folder, "data"))
        generate = ["-m", "evslip", "generate", preset, data, "--workers", "1", "--count"]
        steps = {
            "warm-up": ["-m", "evslip", "warm-up", preset],
            "first sample": [*generate, "1"],
            "second sample": [*generate, "2"],
        }
        for name, words in steps.items():
            clock, cpu, _ = spent(words, environment)
            print(f"| {name} | {clock:.1f} | {cpu:.1f} |", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "NUMBA_CACHE_DIR": folder}
        clock, cpu, printed = spent(["-c", PROFILE, preset], environment)
    rows = [(module, seconds, count) for module, seconds, count in json.loads(printed.splitlines()[-1])]
    compiling, number = sum(row[1] for row in rows), sum(row[2] for row in rows)
    print(f"| first sample in one process | {clock:.1f} | {cpu:.1f} |")
    print(f"\nIn that process: {compiling:.1f} CPU-s of compiling, {number} specialisations\n")
    print("| folder | CPU-s | specialisations |\n|---|---|---|")
    folders: dict[str, list[float]] = collections.defaultdict(lambda: [0.0, 0])
    for module, seconds, count in rows:
        name = ".".join(module.split(".")[:3]) if module.startswith("evslip.") else module.split(".")[0]
        folders[name][0] += seconds
        folders[name][1] += count
    for name, (seconds, count) in sorted(folders.items(), key=lambda item: -item[1][0]):
        print(f"| {name} | {seconds:.1f} | {count} |")


if __name__ == "__main__":
    main()
