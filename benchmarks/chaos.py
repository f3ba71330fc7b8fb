"""What happens to files when processes are killed, disks are full, folders refuse, and bits flip.

python benchmarks/chaos.py [--kills 100] [--count 24] [--workers 2] [--only kills ...] [--verbs import ...] [--seed 0]

Prints a line a trial and exits with 1 if one of them went wrong. Trials that the machine does not allow are skipped.
Generators, too, run in forks of this process, and have spawned workers of their own.
"""

import argparse
import contextlib
import hashlib
import importlib.util
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import chaos_installation
import chaos_verbs

import evslip
from evslip.data import building, layout, requested
from evslip.generation.generate import Job, make_sample

CHEAP = Path(__file__).with_name("cheap.toml")
LOADED = ("evslip.cli.dataset", "evslip.generation.generate", "trimesh", "tyro")
"""Modules that are imported before a generator is forked."""
FLIPS = 200
VERIFIED_BYTES = 300_000_000
Outcome = tuple[bool | None, str]
"""Whether it went right, None if it was skipped; and what was seen."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--count", type=int, default=24)
    parser.add_argument("--workers", type=int, default=2, help="of each generator, where a trial does not say")
    parser.add_argument("--disks", type=int, default=3, help="full ones, with room for a random part")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", nargs="+", choices=TRIALS, default=TRIALS)
    parser.add_argument("--verbs", nargs="+", choices=chaos_verbs.VERBS, default=chaos_verbs.VERBS)
    options = parser.parse_args()
    random.seed(options.seed)
    for name in LOADED:
        importlib.import_module(name)
    os.environ["EVSLIP_PROGRESS_S"] = "3600"  # what is looked at is one line on stderr
    wrong = 0
    with tempfile.TemporaryDirectory() as folder:
        reference = Path(folder, "reference")
        if set(options.only) - {*VERBS_TRIALS, *INSTALLATION_TRIALS}:
            generate(reference, options.count, 1)
            print(f"{options.count} samples, undisturbed: {tree_hash(reference)[:16]}", flush=True)
        for name in options.only:
            start = time.perf_counter()
            is_right, seen = TRIALS[name](Path(folder, name), reference, options)
            wrong += is_right is False
            verdict = {True: "right", False: "WRONG", None: "skipped"}[is_right]
            print(f"{verdict:8}{name:20}{time.perf_counter() - start:6.0f} s  {seen}", flush=True)
    sys.exit(wrong > 0)


def kills(root: Path, reference: Path, options: argparse.Namespace) -> Outcome:
    """A worker, the parent, all: at random moments, until the data set is whole; then another one."""
    done = {"a worker": 0, "the parent": 0, "all": 0}
    hurt, sets, expected = [], 0, hashes(reference)
    while sum(done.values()) < options.kills:
        run = start(root, options.count, options.workers)
        while run.poll() is None and sum(done.values()) < options.kills:
            victims, name = workers_of(run.pid), random.choice(list(done))
            if not victims or not wait_for_a_file(root, run):
                continue
            time.sleep(random.uniform(0, 0.5))
            with contextlib.suppress(ProcessLookupError):
                if name == "a worker":
                    os.kill(random.choice(victims), signal.SIGKILL)
                elif name == "the parent":
                    os.kill(run.pid, signal.SIGKILL)
                else:
                    os.killpg(run.pid, signal.SIGKILL)
                done[name] += 1
            if name != "a worker":
                run.wait()
        end = run.poll()
        while end is not None and end.code and workers_of(run.pid):
            time.sleep(0.1)
        hurt += [name for name, digest in hashes(root).items() if expected.get(name) != digest]
        if end is not None and end.code == 0:
            sets += 1
            if problems(root) or tree_hash(root) != tree_hash(reference):
                return False, f"after {done}: {problems(root)[:3]}"
            shutil.rmtree(root)
    finish = start(root, options.count, options.workers).wait()
    if finish.code or problems(root) or tree_hash(root) != tree_hash(reference):
        return False, f"after {done}: {problems(root)[:3]}"
    seen = ", ".join(f"{name} {times}" for name, times in done.items())
    return not hurt, f"kill -9 of {seen}; {len(hurt)} files hurt; {sets + 1} data sets ended with the undisturbed hash"


def equal(root: Path, reference: Path, options: argparse.Namespace) -> Outcome:
    """Any number of workers, any order, parts, Ray: the same bytes."""
    for workers in (2, 4):
        generate(root / f"{workers} workers", options.count, workers)
    for part in random.sample(range(1, 4), 3):
        generate(root / "parts", options.count, options.workers, "--part", f"{part}/3")
    if importlib.util.find_spec("ray"):
        generate(root / "Ray", options.count, 2, "--runner", "ray")
    found = {folder.name: tree_hash(folder) for folder in sorted(root.iterdir())}
    found["shuffled"] = shuffled(root / "shuffled", reference, options.count)
    right = set(found.values()) == {tree_hash(reference)}
    return right, f"1 worker, {', '.join(found)}: {'equal' if right else found}"


def shuffled(root: Path, reference: Path, count: int) -> str:
    """The hash of a data set whose samples are made in random order, in this process."""
    text = (reference / layout.CONFIG).read_text()
    versions = json.dumps(evslip.open_dataset(reference)[0].provenance)
    building.create(root, text)
    requested.request(root, "train", count)
    for index in random.sample(range(count), count):
        make_sample(Job(str(root), text, "train", index, versions))
    return tree_hash(root)


def together(root: Path, reference: Path, options: argparse.Namespace) -> Outcome:
    """Two generators on the same folder at the same time: of one configuration, then of two."""
    pair = [start(root / "one", options.count, options.workers) for _ in range(2)]
    codes = [run.wait().code for run in pair]
    is_equal = not problems(root / "one") and tree_hash(root / "one") == tree_hash(reference)
    pair = [start(root / "two", options.count, options.workers, "--set", f"seed={seed}") for seed in (0, 1)]
    other = sorted(run.wait().code for run in pair)
    is_whole = not problems(root / "two") and evslip.open_dataset(root / "two").status()["missing"] == 0
    right = codes == [0, 0] and is_equal and other == [0, 2] and is_whole
    return right, f"of one configuration: exit codes {codes}, the undisturbed hash: {is_equal}; of two: {other}"


def full_disk(root: Path, reference: Path, options: argparse.Namespace) -> Outcome:
    """A small file system that fills up; then room is made and the run resumed."""
    with chaos_verbs.mounted(root, "size=1m") as is_mounted:
        if not is_mounted:
            return None, "no right to mount a tmpfs"
        filler = root / "filler"
        filler.write_bytes(bytes(900_000))
        code, words = failing(root / "data", options.count, options.workers)
        filler.unlink()
        subprocess.run(["mount", "-o", "remount,size=64m", str(root)], check=True)
        generate(root / "data", options.count, options.workers)
        right = code == 2 and "no space left" in words and not problems(root / "data")
        right &= tree_hash(root / "data") == tree_hash(reference)
        return right, f"exit code {code}: {words[:70]}...; resumed with room: hash and verify right: {right}"


def read_only(root: Path, reference: Path, options: argparse.Namespace) -> Outcome:
    """A file system that is read-only, with a half-finished data set on it."""
    with chaos_verbs.mounted(root, "size=64m") as is_mounted:
        if not is_mounted:
            return None, "no right to mount a tmpfs"
        shutil.copytree(reference, root / "data")
        victim = next((root / "data").rglob("*.h5"))
        victim.unlink()
        subprocess.run(["mount", "-o", "remount,ro", str(root)], check=True)
        code, words = failing(root / "data", options.count, options.workers)
        opened = len(evslip.open_dataset(root / "data").entries)
        return code == 2 and "read-only" in words, f"exit code {code}: {words[:90]}; {opened} samples stay readable"


def denied(root: Path, reference: Path, options: argparse.Namespace) -> Outcome:
    """A folder of someone else's."""
    shutil.copytree(reference, root)
    next(root.rglob("*.h5")).unlink()
    for folder in [root, *(path for path in root.rglob("*") if path.is_dir())]:
        folder.chmod(0o555)
    code, words = failing(root, options.count + 1, options.workers, before=chaos_verbs.powerless)
    for folder in [root, *(path for path in root.rglob("*") if path.is_dir())]:
        folder.chmod(0o755)
    return code == 2 and "permission denied" in words, f"exit code {code}: {words[:90]}"


def bits(root: Path, reference: Path, options: argparse.Namespace) -> Outcome:
    """Flipped bits anywhere in the folder, each missing record, and a surplus file in every folder."""
    shutil.copytree(reference, root)
    data, found = evslip.open_dataset(root), [0, 0, 0]
    files = sorted(path for path in root.rglob("*") if path.is_file())
    for _ in range(FLIPS):
        path = random.choice(files)
        whole = path.read_bytes()
        flipped = bytearray(whole)
        flipped[random.randrange(len(whole))] ^= 1 << random.randrange(8)
        path.write_bytes(flipped)
        found[0] += bool(data.verify())
        path.write_bytes(whole)
    gone = [path for path in files if path.name != layout.CONFIG]
    for path in gone:
        path.rename(root.with_suffix(".aside"))
        found[1] += bool(data.verify())
        root.with_suffix(".aside").rename(path)
    folders = [path for name in ("samples", "journal") for path in [root / name, *(root / name).rglob("*")]]
    folders = [path for path in folders if path.is_dir()]
    for folder in folders:
        (folder / "stray").touch()
        found[2] += bool(data.verify())
        (folder / "stray").unlink()
    right = found == [FLIPS, len(gone), len(folders)] and not data.verify()
    return right, (
        f"found {found[0]} of {FLIPS} flipped bits, {found[1]} of {len(gone)} missing files, "
        f"{found[2]} of {len(folders)} surplus ones"
    )


def verify_speed(root: Path, reference: Path, options: argparse.Namespace) -> Outcome:
    """Megabytes a second of `verify`, on files of the size that `simple` makes."""
    config = evslip.open_dataset(reference).config_toml
    sample = evslip.open_dataset(reference)[0]
    size = 7_000_000
    building.create(root, config)
    requested.request(root, "train", 1)
    from dataclasses import replace

    for index in range(VERIFIED_BYTES // size):
        building.add(root, replace(sample, index=index), os.urandom(size))
    data = evslip.open_dataset(root)
    start, begun = time.perf_counter(), time.process_time()
    found = data.verify()
    seconds, busy = time.perf_counter() - start, time.process_time() - begun
    total = data.status()["bytes"] / 1e6
    right = not found and total / busy >= 100
    return right, f"{total:.0f} MB: {total / seconds:.0f} MB/s, {total / busy:.0f} MB a CPU second"


def changed(root: Path, reference: Path, options: argparse.Namespace) -> Outcome:
    """Another configuration under an existing data set, by an override and by hand."""
    shutil.copytree(reference, root)
    code, words = failing(root, options.count, options.workers, "--set", "grip.force_n=1.25")
    path = root / layout.CONFIG
    path.write_text(path.read_text().replace("seed = 0", "seed = 7"))
    other, by_hand = failing(root, options.count, options.workers)
    right = (code, other) == (2, 2) and "grip.force_n is 1.0 there and 1.25 now" in words and "seed is 7" in by_hand
    return right, f"exit code {code}: ...{words[-80:]}"


def together_killed(root: Path, reference: Path, options: argparse.Namespace) -> Outcome:
    """Two generators of different configurations on a folder at once, one or both killed, started again until one is
    through: its data set is whole, and the other is refused."""
    done, sets = 0, {0: 0, 1: 0}
    expected = {0: tree_hash(reference)}
    while done < options.kills:
        while True:
            pair = [start(root, options.count, options.workers, "--set", f"seed={seed}") for seed in (0, 1)]
            if done < options.kills:
                time.sleep(random.uniform(0, 8))
                for run in random.sample(pair, random.choice((1, 2))):
                    with contextlib.suppress(ProcessLookupError):  # its group is not there yet
                        if run.poll() is None:
                            os.killpg(run.pid, random.choice((signal.SIGKILL, signal.SIGTERM)))
                            done += 1
            codes, words = zip(*(run.wait() for run in pair), strict=True)
            if 0 in codes:
                break
            if any(code not in (2, 143, -signal.SIGKILL, -signal.SIGTERM) for code in codes):
                return False, f"exit codes {codes}: {words}"
        seed = codes.index(0)
        sets[seed] += 1
        refused = failing(root, options.count, options.workers, "--set", f"seed={1 - seed}")
        same = tree_hash(root) == expected.setdefault(seed, tree_hash(root))
        if refused[0] != 2 or "seed is" not in refused[1] or problems(root) or not same:
            return False, f"after {done} kills: {refused}, {problems(root)[:3]}, equal: {same}"
        shutil.rmtree(root)
    return True, f"{done} kills; {sum(sets.values())} data sets, {sets[0]} of one configuration, all whole"


def verbs_kills(root: Path, reference: Path, options: argparse.Namespace) -> Outcome:
    """SIGKILL and SIGTERM to verbs that write a file or a model."""
    seen, wrong = [], []
    for trial in chaos_verbs.prepared(root, options.verbs):
        problems, ends = chaos_verbs.killed(trial, root / "killed", options.kills)
        wrong += problems
        seen.append(f"{trial.verb}: " + ", ".join(f"{name} {times}" for name, times in ends.items()))
    return not wrong, "; ".join(wrong[:3] or seen)


def verbs_refused(root: Path, reference: Path, options: argparse.Namespace) -> Outcome:
    """The same verbs on disks that are full or read-only, and in a folder of someone else's."""
    seen, wrong = [], []
    for trial in chaos_verbs.prepared(root, options.verbs):
        problems, times = chaos_verbs.full(trial, root / "full", options.count)
        wrong += problems + chaos_verbs.read_only(trial, root / "ro")
        wrong += chaos_verbs.denied(trial, root / f"denied-{trial.verb}")
        seen.append(f"{trial.verb}: full {times} times")
    return not wrong, "; ".join(wrong[:3] or seen) + "; read-only and denied: one line each" * (not wrong)


def installation(trial: Callable[[Path, int], tuple[bool, str]]) -> Callable[..., Outcome]:
    """A trial of `chaos_installation`."""
    return lambda root, reference, options: trial(root, options.disks)


VERBS_TRIALS = {"verbs-kills": verbs_kills, "verbs-refused": verbs_refused}
INSTALLATION_TRIALS = {name: installation(trial) for name, trial in chaos_installation.TRIALS.items()}
TRIALS = {
    "kills": kills,
    "equal": equal,
    "together": together,
    "full-disk": full_disk,
    "read-only": read_only,
    "denied": denied,
    "bits": bits,
    "verify-speed": verify_speed,
    "changed": changed,
    "together-killed": together_killed,
    **VERBS_TRIALS,
    **INSTALLATION_TRIALS,
}


def start(
    root: Path, count: int, workers: int, *arguments: str, before: Callable[[], None] = lambda: None
) -> chaos_verbs.Command:
    words = ["generate", str(CHEAP), str(root), "--count", str(count), "--workers", str(workers)]
    return chaos_verbs.Command([*words, *arguments], before)


def generate(root: Path, count: int, workers: int, *arguments: str) -> None:
    end = start(root, count, workers, *arguments).wait()
    if end.code:
        sys.exit(f"generating {root} failed with exit code {end.code}: {end.words}")


def failing(
    root: Path, count: int, workers: int, *arguments: str, before: Callable[[], None] = lambda: None
) -> tuple[int, str]:
    """Exit code and what was said; anything but one line counts as code -1."""
    code, words = start(root, count, workers, *arguments, before=before).wait()
    return code if words.count("\n") == 1 else -1, words.strip()


def workers_of(group: int) -> list[int]:
    """Processes of the group that work for evslip, its leader left out."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            fields = stat.read_text().rpartition(")")[2].split()
            is_worker = b"spawn_main" in stat.with_name("cmdline").read_bytes()
            if int(fields[2]) == group and fields[0] != "Z" and is_worker and int(stat.parent.name) != group:
                found.append(int(stat.parent.name))
    return found


def wait_for_a_file(root: Path, run: chaos_verbs.Command) -> bool:
    """Until there is one more record; False if the generator ended instead."""
    before = len(hashes(root))
    while run.poll() is None:
        if len(list(root.rglob("*.h5"))) > before:
            return True
        time.sleep(0.02)
    return False


def hashes(root: Path) -> dict[str, str]:
    """Path and sha256 of every record."""
    return {
        str(path.relative_to(root)): hashlib.sha256(path.read_bytes()).hexdigest() for path in root.rglob("[0-9]*.h5")
    }


def tree_hash(root: Path) -> str:
    return hashlib.sha256(json.dumps(sorted(hashes(root).items())).encode()).hexdigest()


def problems(root: Path) -> list[str]:
    return evslip.open_dataset(root).verify()


if __name__ == "__main__":
    main()
