"""The paper's experiment, whole: python experiments/reproduce.py [--small]

Data sets, windows, detectors, the test set, shifted worlds, an ablation, real recordings: all with evslip's own
commands, each printed before it runs. Run it again after a stop: what is finished is not done again. Writes
results.md and all that its tables are read from into one folder, and exits with 1 if a table has a gap.
"""

import argparse
import sys
from collections.abc import Callable
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import results
import stages
from plan import NETWORKS, SMALL, SWEEPS, Plan
from ship import ship
from steps import Runner, Step
from worlds import FIXED, WORLDS, write_mesh


def generate(makings: list[Step], plan: Plan, runner: Runner) -> None:
    """Fill data sets: one after another on all cores or, where each has one process, as many together as jobs."""
    runner.run(makings, together=plan.workers == 1)


def make_data(plan: Plan, runner: Runner) -> None:
    makings, checks = stages.data(plan)
    generate(makings, plan, runner)
    runner.run(checks, together=True)


def cut_windows(plan: Plan, runner: Runner) -> None:
    runner.run(list(stages.windows(plan).values()), together=True)


def train(plan: Plan, runner: Runner) -> None:
    runner.run(stages.train(plan), together=True)


def sweep(plan: Plan, runner: Runner) -> None:
    runner.run(stages.sweep(plan), together=True)
    runner.run(stages.tuned(plan), together=True)


def test(plan: Plan, runner: Runner) -> None:
    runner.run(stages.test(plan), together=True)


def shift_worlds(plan: Plan, runner: Runner) -> None:
    if "mesh" in plan.worlds and not stages.mesh_path(plan).exists():
        write_mesh(stages.mesh_path(plan))
    makings, trials = stages.worlds(plan)
    generate(makings, plan, runner)
    runner.run(trials, together=True)


def ablate(plan: Plan, runner: Runner) -> None:
    makings, cuts, trainings, trials = stages.ablation(plan)
    generate(makings, plan, runner)
    runner.run(cuts, together=True)
    runner.run(trainings, together=True)
    runner.run(trials, together=True)


def try_real(plan: Plan, runner: Runner) -> None:
    if plan.real is None:
        print("real: no recordings were given (--real FOLDER): left out")
    for _, about, says in stages.real(plan):
        runner.run([about, *says.values()])


def ship_one(plan: Plan, runner: Runner) -> None:
    del runner
    print(f"{ship(plan)}: model.json, model.safetensors, README.md")


STAGES: dict[str, Callable[[Plan, Runner], None]] = {
    "data": make_data,
    "windows": cut_windows,
    "train": train,
    "sweep": sweep,
    "test": test,
    "worlds": shift_worlds,
    "ablation": ablate,
    "real": try_real,
    "ship": ship_one,
}


def main() -> int:
    plan, chosen = read_plan()
    plan.out.mkdir(parents=True, exist_ok=True)
    if set(chosen) != {"tables"}:
        results.note_machine(plan)
    runner = Runner(plan.out, plan.jobs)
    for name, stage in STAGES.items():
        if name in chosen:
            print(f"--- {name}", flush=True)
            stage(plan, runner)
    if "tables" not in chosen:
        return 0
    gaps = results.write(plan, ["python", "experiments/reproduce.py", *told(sys.argv[1:])])
    print(f"{plan.out / 'results.md'}: " + (f"not whole: {'; '.join(gaps)}" if gaps else "every table is whole"))
    return 1 if gaps else 0


def told(words: list[str]) -> list[str]:
    """The command line without what the results do not depend on, and without paths of this machine."""
    kept, option = [], ""
    for word in words:
        if word.startswith("--"):
            option = word.partition("=")[0]
        if option not in HIDDEN:
            kept.append("--real=RECORDINGS" if word.startswith("--real=") else word)
        if option == "--real" and not word.startswith("--"):
            kept[-1] = "RECORDINGS"
    return kept


HIDDEN = ("--stages", "--out", "--workers", "--jobs", "--ship-model", "--ship-to")
NUMBERS = {
    "simple": "samples of the Simple Set",
    "complex-train": "training samples of the Complex Set",
    "complex-test": "test samples of the Complex Set",
    "world": "samples of each shifted world ...",
    "traced": "... but of the path-traced one, which takes some seventy times as long",
    "ablation-train": "training samples of each step of the ablation",
    "ablation-test": "test samples of the ablation",
    "trials": "of each sweep; 0: no sweep",
    "resamples": "of the trajectories, for confidence intervals",
    "workers": "processes of each generator; default: one a core; 1: as many generators together as jobs",
    "jobs": "trainings and evaluations at the same time",
}
MAY_BE_NONE = ("trials", "resamples")


def read_plan() -> tuple[Plan, tuple[str, ...]]:
    """What the command line asks for: the plan, and the stages."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("--small", action="store_true", help="every stage once, in less than ten minutes on two cores")
    add("--out", type=Path, help="folder of everything; default: reproduced, or reproduced-small")
    add("--stages", nargs="+", choices=[*STAGES, "tables"], default=(*STAGES, "tables"))
    for name, text in NUMBERS.items():
        add(f"--{name}", type=int, help=text)
    add("--hop-s", type=float, help="time between two answers in evaluations")
    add("--window-hop-s", type=float, help="from one training window's start to the next one's")
    add("--seeds", nargs="+", type=int)
    add("--networks", nargs="+", choices=NETWORKS)
    add("--finals", nargs="+", choices=NETWORKS, help="networks tried in shifted worlds and on real recordings")
    add("--ablated", nargs="+", choices=NETWORKS, help="networks that the ablation trains")
    add("--worlds", nargs="*", choices=list(WORLDS))
    add("--ablations", nargs="*", choices=list(FIXED))
    add("--real", type=Path, help="folder with real recordings; default: none are tried")
    add("--keys", nargs="*", metavar="KEY=VALUE", help="keys replaced in every data set")
    add("--training", nargs="*", metavar="[NETWORK:]OPTION=VALUE", help="options of `evslip train`")
    add("--sweeps", nargs="*", choices=SWEEPS, help="sets and networks whose settings are searched")
    add("--space", help="what a sweep tries")
    add("--ship-model", metavar="NETWORK-SEED", help="model to ship; default: the best final by validation")
    add("--ship-to", type=Path, help="folder to ship it to; default: the folder `default` of the experiment")
    given = {name: tuple(v) if isinstance(v, list) else v for name, v in vars(parser.parse_args()).items()}
    chosen, plan = given.pop("stages"), SMALL if given.pop("small") else Plan(Path("reproduced"))
    return checked(replace(plan, **{name: value for name, value in given.items() if value is not None})), chosen


def checked(plan: Plan) -> Plan:
    """Without what this machine cannot do; finals are among the networks. Exits with one line if a value is wrong."""
    for name in NUMBERS:
        value, least = getattr(plan, name.replace("-", "_")), int(name not in MAY_BE_NONE)
        if value is not None and value < least:
            raise SystemExit(f"{name}: {value} is out of range, expected {least} or more")
    if min(plan.seeds) < 0:
        raise SystemExit(f"seeds: {min(plan.seeds)} is out of range, expected 0 or more")
    finals = tuple(name for name in plan.finals if name in plan.networks)
    plan = replace(plan, finals=finals or plan.networks[-1:])
    if "pathtraced" in plan.worlds and find_spec("mitsuba") is None:
        print("worlds: Mitsuba is not installed (pip install 'evslip[photo]'): path-traced frames are left out")
        plan = replace(plan, worlds=tuple(name for name in plan.worlds if name != "pathtraced"))
    if plan.real is not None and not plan.real.is_dir():
        raise SystemExit(f"real: {plan.real} is no folder; expected one with recordings")
    bad = [text for text in plan.keys if "=" not in text]
    if bad:
        raise SystemExit(f"keys: {bad[0]!r} is wrong, expected KEY=VALUE")
    return plan


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit("stopped; what was finished is kept: run it again to go on")
