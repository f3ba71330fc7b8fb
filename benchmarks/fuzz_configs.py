"""Mutated configurations through `evslip generate`: each is valid, or ends with exit code 2 and one line with a key.

python benchmarks/fuzz_configs.py [--count 1000] [--samples 20] [--seed 0] [--show]

Values out of range, of wrong types, misspelt keys, torn text; every tenth is monstrous: numbers of thousands of digits,
50,000 brackets, lists of 100,000 entries, patterns over the whole disk, devices, pipes, counts without end. What is
refused may use 5 CPU seconds and leaves nothing behind; what is valid 60, and 3 GB. Of the valid ones, --samples are
made, with a small camera.
"""

import argparse
import collections
import contextlib
import copy
import io
import os
import random
import resource
import signal
import sys
import tempfile
import time
import traceback
from pathlib import Path
from typing import Any, get_args
from unittest import mock

import evslip
from evslip import cli
from evslip.config.loading import dump_config, load_config
from evslip.config.presets import PRESETS
from evslip.config.sample import SampleSpec
from evslip.config.section import OneOf, Within
from evslip.draws.draw import draw
from evslip.generation import generate

CPU_S, REFUSED_S, MORE_BYTES = 60, 5, 3_000_000_000
MODELS: dict[str, Any] = {name: field.annotation for name, field in SampleSpec.model_fields.items()}
SECTIONS = {name: list(model.model_fields) for name, model in MODELS.items()}
TOP = ("seed", "sampling", "test_share", "together", "slip_fraction", "preset")
OPTIONS = ("count", "workers", "part", "limit-s", "limit_s", "cannot be read as a TOML file", "override")
"""Words that name what is wrong with options, or with a whole file."""
NAMES = ("side", "front", "hold", "natural", "*", "plastic-0", "wood-1", "cylinder", "mesh", "shake", "rotate", "grid")


class Exhausted(BaseException):
    """The configuration has used up its processor time."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--samples", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--show", action="store_true", help="print what each was told")
    options = parser.parse_args()
    signal.signal(signal.SIGPROF, exhausted)
    evslip.generate  # noqa: B018  imports what takes memory
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + MORE_BYTES, resource.RLIM_INFINITY))
    outcomes, made = collections.Counter(), collections.Counter()
    for number in range(options.count):
        rng = random.Random(f"{options.seed} {number}")
        text = mutated(rng)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "fuzzed.toml")
            path.write_text(text, encoding="utf-8", errors="surrogateescape")
            path, more = monstrous(rng, path) if number % 10 == 9 else (path, ["--count", "5"])
            start = time.process_time()
            outcome, words = limited(lambda path=path, more=more, out=Path(folder, "out"): told(path, out, more))
            if outcome == "refused" and time.process_time() - start > REFUSED_S:
                outcome = "refused late"
            if outcome == "refused" and Path(folder, "out").exists():
                outcome = "refused, but left a folder"
            if outcome == "valid" and sum(made.values()) < options.samples:
                kind, words = limited(lambda path=path: sample(path))
                made[kind] += 1
                outcome = "valid" if kind in ("simulated", "rejected") else f"valid, then {kind}"
        outcomes[outcome] += 1
        if options.show or outcome not in ("valid", "refused"):
            print(f"{number} {outcome}: {words}", flush=True)
        if (number + 1) % 200 == 0:
            print(f"{number + 1}: {dict(outcomes)}", flush=True)
    print(f"{options.count} configurations: {dict(outcomes)}; samples made of valid ones: {dict(made)}")
    sys.exit(set(outcomes) - {"valid", "refused"} != set())


def told(path: Path, out: Path, more: list[str]) -> tuple[str, str]:
    """What the command line makes of a file and options, short of making samples."""
    words = io.StringIO()
    arguments = ["evslip", "generate", str(path), str(out), *more]
    nobody = mock.patch.object(generate, "runner", lambda name: lambda *_: iter(()))
    cold = mock.patch.object(generate, "warm_up", lambda *_, **__: 0)
    with nobody, cold, mock.patch.object(sys, "argv", arguments):
        try:
            with contextlib.redirect_stderr(words), contextlib.redirect_stdout(io.StringIO()):
                cli.main()
        except SystemExit as stopped:
            line = words.getvalue()
            if stopped.code != 2 or line.count("\n") != 1:
                return f"exit code {stopped.code}, {line.count(chr(10))} lines", line
            return ("refused" if names_a_key(line) else "refused without a key"), line.strip()
    return "valid", ""


def sample(path: Path) -> tuple[str, str]:
    """A whole sample of a valid file, with a small camera."""
    config = load_config(path, {"camera.width": 24, "camera.height": 16, "render.max_motion_px": 16.0})
    record = generate.make_record(draw(config, 0))
    return record.kind, dump_config(config)[:0]


def limited(work) -> tuple[str, str]:
    signal.setitimer(signal.ITIMER_PROF, CPU_S)
    try:
        return work()
    except Exhausted:
        return "hang", "".join(traceback.format_exc().splitlines(True)[-6:])
    except Exception:
        return "traceback", "".join(traceback.format_exc().splitlines(True)[-6:])
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)


def exhausted(*_) -> None:
    raise Exhausted


def monstrous(rng: random.Random, path: Path) -> tuple[Path, list[str]]:
    """A configuration, or options, beyond all bounds."""
    key, field = rng.choice(("object.mass_kg", "object.texture", "seed", "motion.cycles", "camera.width")), "x"
    section, _, field = key.rpartition(".")
    huge = rng.choice(("9" * 400, "9" * 5000, "-" + "9" * 400, "1e999999"))
    entry = rng.choice(("0.1", "{ min = 0.1, max = 0.2 }", '"wood-1"', '"cuboid"', huge))
    value = rng.choice(
        (
            huge,
            "[" * 50_000,
            "[" * 300 + "]" * 300,
            "{ a = " * 50_000,
            f"[{', '.join([entry] * 100_000)}]",
            f'"{rng.choice(("/**", "/proc/**/*.png", "/*/*/*/*", "/", "/dev/zero", "/dev/null", "~/**", "**"))}"',
            f'"{"x" * 1_000_000}"',
            "{ " + ".".join("a" * 50_000) + " = 1 }",
        )
    )
    kind = rng.randrange(10)
    if kind < 6:
        path.write_text((f"[{section}]\n" if section else "") + f"{field} = {value}\n")
        return path, ["--count", "5"]
    if kind == 6:
        path.unlink()
        os.mkfifo(path)
        others = ("/dev/zero", "/dev/null", "/proc/self/mem", str(path.parent), "x" * 5000)
        return Path(rng.choice((str(path), *others))), ["--count", "5"]
    if kind == 7:
        many = ("[a]\n" * 100_000, "a = 1\n" * 100_000, "# " + "x" * 5_000_000)
        path.write_text(rng.choice((*many, "\0" * 1000, "\ufeffseed = -1")))
        return path, ["--count", "5"]
    path.write_text("seed = 0\n")
    number = rng.choice(("0", "-1", "1000000000", "9" * 30, "9" * 5000, "nan", "1e9", ""))
    options = ["--count", rng.choice((number, "5")), rng.choice(("--workers", "--part", "--limit-s", "--set")), number]
    if options[2] == "--part":
        options[3] = rng.choice((f"1/{number}", f"{number}/1", "0/1", "2/1"))
    if options[2] == "--set":
        options[3] = f"{key}={value[:100_000]}"
    return path, options


def names_a_key(line: str) -> bool:
    if any(word in line for word in OPTIONS):
        return True
    names = [f"{section}.{name}" for section, fields in SECTIONS.items() for name in fields]
    return any(word in line for word in (*names, *(f"{name}:" for name in (*SECTIONS, *TOP)), "not valid TOML", "key"))


def mutated(rng: random.Random) -> str:
    """A preset's text after a few changes: values out of range, of wrong types, misspelt keys, torn text."""
    config = load_config(rng.choice(PRESETS))
    tree = config.model_dump(mode="json", exclude_none=True)
    changed = copy.deepcopy(tree)
    for _ in range(rng.choice((1, 1, 2, 3, 5))):
        section = rng.choice(list(SECTIONS))
        field = rng.choice(SECTIONS[section])
        value = any_value(rng, tree)
        if rng.random() < 0.75 and isinstance(changed.get(section), dict):
            changed[section][field] = plausible(rng, section, field, value)
            continue
        match rng.randrange(10):
            case 0:
                changed[rng.choice(TOP)] = value
            case 1:
                changed[section] = value
            case 2 if isinstance(changed.get(section), dict):
                changed[section].pop(field, None)
            case 3 if isinstance(changed.get(section), dict):
                changed[section][field[:-1] + rng.choice("xyz")] = value
            case _ if isinstance(changed.get(section), dict):
                changed[section][field] = value
    text = "\n".join(lines(changed))
    if rng.random() < 0.1:
        place = rng.randrange(len(text))
        text = text[:place] + rng.choice(("", "=", "[", "]]", "\n", '"', "\0", "é", "\udcff")) + text[place + 3 :]
    return text


def plausible(rng: random.Random, section: str, field: str, other: object) -> object:
    """A value, range or list within the limits of a field, mostly; the ends too."""
    described = MODELS[section].model_fields[field]
    within = next((limit for limit in described.metadata if isinstance(limit, Within)), None)
    names = [limit.names for limit in described.metadata if isinstance(limit, OneOf)] or [
        get_args(described.annotation)
    ]
    if words := [name for name in names[0] if isinstance(name, str)]:
        return rng.choice((rng.choice(words), list(words)))
    if within is None:
        return other
    if described.annotation is int:
        return rng.choice((int(within.low), int(within.high), rng.randint(int(within.low), int(within.high))))
    span = within.high - within.low
    low, high = sorted(within.low + span * rng.random() ** rng.choice((1, 4)) for _ in range(2))
    constants = (within.low, within.high, low, high, {"min": low, "max": high}, {"min": within.low, "max": within.high})
    return rng.choice((*constants, [low, high, within.low], [{"min": within.low, "max": low}, high]))


def any_value(rng: random.Random, tree: dict) -> object:
    other = rng.choice([v for section in tree.values() if isinstance(section, dict) for v in section.values()])
    number = rng.choice((0, 1, -1, 0.5, 3, 10, 60, 90, 1000, 1e-9, 1e9, 1e308, -1e308, 2**63, 10**30, 0.001, 0.1))
    if isinstance(other, int | float) and not isinstance(other, bool):
        other = rng.choice((other, other * rng.choice((0.5, 0.9, 1.1, 2, 10, -1, 1000))))
    ends = sorted((rng.uniform(-1, 1) * 10 ** rng.randrange(-3, 4), rng.uniform(0, 1) * 10 ** rng.randrange(-3, 4)))
    return rng.choice(
        (
            *(other,) * 4,
            *(number,) * 4,
            *({"min": ends[0], "max": ends[1]},) * 2,
            rng.uniform(0, 1) * 10 ** rng.randrange(-4, 5),
            [number, other],
            [rng.uniform(0, 0.1) for _ in range(rng.choice((1, 2, 50)))],
            rng.choice(NAMES),
            [rng.choice(NAMES), rng.choice(NAMES)],
            rng.choice(("", "x" * 10_000, "../../etc/passwd", "/dev/zero", "/", "\n")),
            float("nan"),
            float("inf"),
            True,
            [],
            {},
            {"min": 1, "max": 1, "law": "sphere"},
            [[["x"]]],
            [{"x_m": number, "time_s": rng.choice((0.05, 1.0, 60.0))} for _ in range(rng.choice((1, 3, 2000)))],
        )
    )


def lines(tree: dict) -> list[str]:
    plain = [f"{key} = {toml(value)}" for key, value in tree.items() if not isinstance(value, dict)]
    sections = [(key, value) for key, value in tree.items() if isinstance(value, dict)]
    return plain + [
        line for key, value in sections for line in (f"[{key}]", *(f"{k} = {toml(v)}" for k, v in value.items()))
    ]


def toml(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {toml(entry)}" for key, entry in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    return '"' + value.replace("\n", "\\n") + '"' if isinstance(value, str) else repr(value)


if __name__ == "__main__":
    main()
