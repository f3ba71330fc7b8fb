"""Checks the physics against theory and prints tables: python benchmarks/physics.py [--only NAME ...] [--count N]

onset    a hand that does not move: simulated over predicted onset mass, by bisection, in --count cases of a grid
motion   the whole pick-and-place: --count random draws hold at 0.85 and slip at 1.25 times evslip.onset_mass
creep    --count random draws at 0.1-0.7 times the onset: the largest movement within any held window of 0.16 s, with
         the object in its place and 2 mm and 1 deg off it
chatter  normal forces while an object slides, with the pads' compliance and without
cost     processor seconds of draw, plan and simulation, and memory over --count samples

With --robot all: every robot, with each of its grippers, one after the other.
With --grip-varies: onset, creep and chatter under a grip force that changes, and slips that are stopped by it.

Without --count every table has the size that docs/explanation/physics.md quotes. Equal --seed, equal results.
Exit code 1: a bound is not kept.
"""

import argparse
import itertools
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from fixed_hand import hang
from grip_varies import GRIP_TABLES
from physics_cases import (
    CREEP_DEG,
    CREEP_MM,
    CUBOID,
    RATIO,
    ROBOTS,
    VARIED,
    bisected,
    gripped,
    hanging_onset_kg,
    largest_creep,
    params_of,
    progress,
    weighing,
)

import evslip
from evslip.config.params import Params
from evslip.draws.stratification import SURE_HOLD, SURE_SLIP
from evslip.utils.errors import GraspFailed

DEPTHS_MM, OFFSETS_MM = (-4, 0, 4, 8, 12), (0, 5, 10, 15, 20)
FORCES_N, FRICTIONS = (2, 5, 20), (0.3, 0.5, 1.0)
COST_S = 0.6
STIFF = {"PAD_GIVE_M": 1e-5, "PAD_SLACK_M_S2": 30.0}
"""Pads nearly as hard as MuJoCo's default contact."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=TABLES, default=list(TABLES))
    parser.add_argument("--grip-varies", action="store_true", help="tables of a force that changes instead")
    parser.add_argument("--count", type=int)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--robot", default="panda", help=f"{', '.join(ROBOTS)}, all, or a robot's file")
    options = parser.parse_args()
    if options.robot not in (*ROBOTS, "all") and not options.robot.endswith(".toml"):
        parser.error(
            f"--robot: {options.robot!r} is unknown; expected one of {', '.join(ROBOTS)}, all, or a .toml file"
        )
    kept = []
    chosen = GRIP_TABLES if options.grip_varies else {name: TABLES[name] for name in options.only}
    robots = ROBOTS if options.robot == "all" else (options.robot,)
    for robot, (name, (table, count)) in itertools.product(robots, chosen.items()):
        start = time.process_time()
        print(f"\n## {name}, {robot}\n" if len(robots) > 1 else f"\n## {name}\n", flush=True)
        kept.append(table(options.count or count, options.seed, robot))
        print(f"\n{'kept' if kept[-1] else 'NOT KEPT'}; {time.process_time() - start:.0f} CPU-s", flush=True)
    sys.exit(not all(kept))


def onset(count: int, seed: int, robot: str) -> bool:
    """Simulated over predicted onset mass in a hand that does not move."""
    grid = list(itertools.product(FORCES_N, FRICTIONS, DEPTHS_MM, OFFSETS_MM))
    chosen = np.random.default_rng(seed).permutation(len(grid))[:count]
    ratios = np.full((len(FORCES_N), len(FRICTIONS), len(DEPTHS_MM), len(OFFSETS_MM)), np.nan)
    for k in progress(np.sort(chosen).tolist()):
        force, friction, depth, offset = grid[k]
        ratios.flat[k] = bisected(params_of(0, seed, robot, CUBOID | gripped(depth, offset, force, friction)))
    print(f"{np.isfinite(ratios).sum()} cases; smallest...largest over forces {FORCES_N} N and frictions {FRICTIONS}")
    print("| depth of the tool centre, mm | " + " | ".join(f"offset {offset} mm" for offset in OFFSETS_MM) + " |")
    print("|---" * (1 + len(OFFSETS_MM)) + "|")
    for depth, row in zip(DEPTHS_MM, np.moveaxis(ratios, (2, 3), (0, 1)), strict=True):
        print(f"| {depth} | " + " | ".join(_span(cell[np.isfinite(cell)]) for cell in row) + " |")
    low, high = np.nanmin(ratios), np.nanmax(ratios)
    print(f"all: {low:.3f}...{high:.3f}, wanted {RATIO[0]}...{RATIO[1]}")
    return bool(low >= RATIO[0] and high <= RATIO[1])


def motion(count: int, seed: int, robot: str) -> bool:
    """Whether the whole pick-and-place holds and slips where it should."""
    right = {SURE_HOLD: 0, SURE_SLIP: 0}
    wrong = []
    for index in progress(range(count)):
        params = params_of(index, seed, robot, VARIED)
        for multiple, slips in ((SURE_HOLD, False), (SURE_SLIP, True)):
            slipped = _slips(weighing(params, multiple * evslip.onset_mass(params)))
            right[multiple] += slipped == slips
            if slipped != slips:
                wrong.append(f"index {index} at {multiple}")
    print("| mass, multiples of the onset | as predicted |\n|---|---|")
    print(f"| {SURE_HOLD} | {right[SURE_HOLD]} of {count} hold |\n| {SURE_SLIP} | {right[SURE_SLIP]} of {count} slip |")
    print("\n".join(wrong))
    return not wrong


def _slips(params: Params) -> bool:
    try:
        return evslip.measure(evslip.simulate(params)).onset_us is not None
    except GraspFailed as failure:
        return failure.kind == "never_lifted"


def creep(count: int, seed: int, robot: str) -> bool:
    """Largest movement of held objects within a window."""
    sides = np.random.default_rng(seed).choice([-1.0, 1.0], (count, 3))
    multiples = np.random.default_rng(seed + 1).uniform(0.1, 0.7, count)
    kept = True
    print(
        "| object | draws | rotation in the worst window, deg | median | translation, mm | median |\n"
        + "|---" * 6
        + "|"
    )
    for name, off in (("in its place", 0.0), ("2 mm along x and y and 1 deg off", 1.0)):
        worst = np.empty((count, 2))
        for index in progress(range(count)):
            x, y, yaw = off * sides[index] * [0.002, 0.002, 1.0]
            error = {"grip.error_x_m": x, "grip.error_y_m": y, "grip.error_yaw_deg": yaw}
            params = params_of(index, seed, robot, VARIED | error)
            worst[index] = largest_creep(
                evslip.measure(evslip.simulate(weighing(params, float(multiples[index]) * evslip.onset_mass(params))))
            )
        (turn, slide), (turns, slides) = worst.max(axis=0), np.median(worst, axis=0)
        print(f"| {name} | {count} | {turn:.4f} | {turns:.4f} | {slide:.3f} | {slides:.3f} |", flush=True)
        kept &= bool(turn <= CREEP_DEG and slide <= CREEP_MM)
    print(f"wanted: at most {CREEP_DEG} deg and {CREEP_MM} mm")
    return kept


def chatter(count: int, seed: int, robot: str) -> bool:
    """Normal force of the pads while an object slides out of the hand, with compliant pads and with stiff ones."""
    print("| pads | friction | fastest, m/s | normal force over grip force, mean | deviation | least | most |")
    print("|---" * 7 + "|")
    kept = True
    for name, constants in (("compliant", {}), ("stiff", STIFF)):
        for friction in FRICTIONS:
            force, speed = slide(friction, constants)
            print(
                f"| {name} | {friction} | {speed:.2f} | {force.mean():.3f} | {force.std():.3f} | {force.min():.2f} "
                f"| {force.max():.2f} |"
            )
            kept &= bool(constants or force.std() < 0.05)
    return kept


def slide(friction: float, constants: dict[str, float]) -> tuple[np.ndarray, float]:
    """Force of both pads, over the grip force, in the first 6 mm of a slide at 1.3 times the onset mass; top speed."""
    params = params_of(0, 0, "panda", CUBOID | gripped(12, 0, 1, friction))
    motion = hang(weighing(params, 1.3 * hanging_onset_kg(params)), constants)
    way = -motion.position_m[:, 2]
    sliding = (way > 1e-4) & (way < 6e-3)
    return motion.pads_n[sliding] / params.grip.force_n, float(np.gradient(way, motion.t_s)[sliding].max())


def cost(count: int, seed: int, robot: str) -> bool:
    """Processor seconds and memory."""
    memory = []
    evslip.simulate(params_of(0, seed, robot, {}))
    start = time.process_time()
    for index in progress(range(count)):
        evslip.simulate(params_of(index, seed, robot, {}))
        memory.append(_resident_mb())
    seconds = (time.process_time() - start) / count
    tenth = max(1, count // 10)
    print(f"| CPU-s a sample | resident MB after {tenth} samples | after {count} |\n|---|---|---|")
    print(f"| {seconds:.3f} | {memory[tenth - 1]:.0f} | {memory[-1]:.0f} |")
    print(f"wanted: at most {COST_S} CPU-s; peak {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")
    return seconds <= COST_S and memory[-1] - memory[tenth - 1] < 20


def _resident_mb() -> float:
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / 2**20


def _span(values: np.ndarray) -> str:
    return f"{values.min():.3f}...{values.max():.3f}" if len(values) else "-"


TABLES: dict[str, tuple[Callable[[int, int, str], bool], int]] = {
    "onset": (onset, 225),
    "motion": (motion, 60),
    "creep": (creep, 200),
    "chatter": (chatter, 3),
    "cost": (cost, 500),
}
"""Each table and how much it does without --count."""

if __name__ == "__main__":
    main()
