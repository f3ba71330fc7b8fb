"""Tables of physics.py --grip-varies: pads under a grip force that changes."""

from collections.abc import Callable

import numpy as np
from fixed_hand import hang
from physics_cases import (
    CREEP_DEG,
    CREEP_MM,
    CUBOID,
    RATIO,
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
from evslip.physics.motion.phases import phase_times
from evslip.physics.stepping import SteppedSimulation
from evslip.physics.truth import Truth, measure

FROM_TO_N = ((1.0, 20.0), (0.5, 20.0), (5.0, 20.0), (1.0, 5.0), (5.0, 1.0), (5.0, 0.5), (20.0, 0.5))
PLACES_MM = ((4, 0), (8, 10), (12, 20))
"""Depth of the tool centre and grip off the centre."""
SHAPES, FRICTIONS = ("cuboid", "cylinder"), (0.3, 1.0)
LEAST_N, MOST_N = 0.5, 20.0
CONTROL_US = 10_000
STOP_N, KINDS, LATE_MS = 8.0, ("panda", "ideal"), (0, 20, 40)
CHATTER, RIPPLE = 0.03, 0.03
"""Largest deviation of the pads' force from the grip force, and of the utilisation from that of the load, as shares of
the grip force and of the friction."""
PROFILES: dict[str, tuple[str, Callable[[float], float]]] = {
    "constant 0.5 N": ("panda", lambda s: 0.0),
    "ramps": ("panda", lambda s: abs(s % 2.0 - 1.0)),
    "steps": ("panda", lambda s: float(s % 0.8 < 0.4)),
    "sine of 2 Hz": ("panda", lambda s: 0.5 - 0.5 * np.cos(4 * np.pi * s)),
    "sine of 10 Hz": ("fast", lambda s: 0.5 - 0.5 * np.cos(20 * np.pi * s)),
    "steps of a fast actuator": ("fast", lambda s: float(s % 0.8 < 0.4)),
}
"""Actuator and commanded force over time: 0 is LEAST_N, 1 is MOST_N."""


def onset(count: int, seed: int, robot: str) -> bool:
    """Simulated over predicted onset mass in a hand that does not move, after the force has gone to another."""
    print("| force, N | " + " | ".join(f"{shape}, μ {mu}" for shape in SHAPES for mu in FRICTIONS) + " |")
    print("|---" * (1 + len(SHAPES) * len(FRICTIONS)) + "|")
    every: list[float] = []
    for first, last in FROM_TO_N:
        cells = []
        for shape in SHAPES:
            for friction in FRICTIONS:
                ratios = []
                for depth, offset in PLACES_MM[:count]:
                    place = {**CUBOID, "object.shape": shape, **gripped(depth, offset, first, friction)}
                    ratios.append(bisected(params_of(0, seed, robot, place), regrip_n=last))
                cells.append(f"{min(ratios):.3f}...{max(ratios):.3f}")
                every += ratios
        print(f"| {first:g} to {last:g} | " + " | ".join(cells) + " |", flush=True)
    print(f"all: {min(every):.3f}...{max(every):.3f}, wanted {RATIO[0]}...{RATIO[1]}")
    return min(every) >= RATIO[0] and max(every) <= RATIO[1]


def creep(count: int, seed: int, robot: str) -> bool:
    """Movement of held objects within a window, and what pads and friction do, while the force varies."""
    multiples = np.random.default_rng(seed + 1).uniform(0.1, 0.7, count)
    print(
        "| force from 0.5 to 20 N | actuator | draws | rotation in the worst window, deg | translation, mm "
        "| pads' force over grip force | utilisation off that of the load |\n" + "|---" * 7 + "|"
    )
    kept = True
    for name, (actuator, profile) in PROFILES.items():
        rows = []
        for index in progress(range(count)):
            params = params_of(index, seed, robot, VARIED | {"grip.actuator": actuator})
            least = float(multiples[index]) * evslip.onset_mass(params) * LEAST_N / params.grip.force_n
            rows.append(_carried(weighing(params, least), profile))
        turn, slide, low, high, ripple = np.array(rows).T
        cells = name, actuator, count, f"{turn.max():.4f}", f"{slide.max():.3f}", f"{low.min():.3f}...{high.max():.3f}"
        print("| " + " | ".join(map(str, cells)) + f" | {ripple.max():.3f} |", flush=True)
        kept &= bool(turn.max() <= CREEP_DEG and slide.max() <= CREEP_MM and ripple.max() <= RIPPLE)
        kept &= bool(low.min() >= 1 - CHATTER and high.max() <= 1 + CHATTER)
    print(f"wanted: at most {CREEP_DEG} deg, {CREEP_MM} mm, {CHATTER} and {RIPPLE} off")
    return kept


def _carried(params: Params, profile: Callable[[float], float]) -> tuple[float, ...]:
    """Rotation and translation in the worst window, least and largest force of the pads over the grip force, and
    largest deviation of the utilisation, of an object that is carried."""
    simulation = SteppedSimulation(params)
    start_us, end_us = phase_times(params)["lift"][0], phase_times(params)["release"][0]
    pads, used = [], []
    simulation.advance(start_us)
    while simulation.t_us < end_us:
        share = profile((simulation.t_us - start_us) / 1e6)
        until_us = simulation.t_us + CONTROL_US
        while simulation.t_us < min(until_us, end_us):
            simulation.advance(simulation.t_us + 1000, LEAST_N + share * (MOST_N - LEAST_N))
            sample = simulation.trajectory(simulation.t_us)
            pads.append(sample.pad_force_n[0].mean() / simulation.force_n)
            needed = simulation.least_force_n() / simulation.force_n
            used.append((simulation.t_us, simulation.utilisation.mean() - needed))
    truth = measure(simulation.trajectory())
    held = truth.t_us[truth.held]
    inside = [abs(off) for t_us, off in used if held[0] + 50_000 < t_us < held[-1] - 50_000]
    return *largest_creep(truth), min(pads), max(pads), max(inside)


def chatter(count: int, seed: int, robot: str) -> bool:
    """Pads' force over the grip force while an object slides and the grip force swings by 20 %."""
    print("| grip force, N | swing, Hz | pads' force over grip force, mean | deviation | least | most |")
    print("|---" * 6 + "|")
    kept = True
    for force in (1.0, 5.0):
        for hz in (5.0, 20.0, 50.0)[:count]:
            params = params_of(0, seed, robot, CUBOID | gripped(12, 0, force, 0.5))
            motion = hang(weighing(params, 1.5 * hanging_onset_kg(params)), swing=(0.2, hz))
            way = -motion.position_m[:, 2]
            sliding = (way > 1e-4) & (way < 6e-3)
            ratio = motion.pads_n[sliding] / motion.force_n[sliding, None]
            cells = f"{ratio.mean():.3f} | {ratio.std():.3f} | {ratio.min():.2f} | {ratio.max():.2f}"
            print(f"| {force:g} | {hz:g} | {cells} |")
            kept &= bool(ratio.std() < 0.05)
    return kept


def stop(count: int, seed: int, robot: str) -> bool:
    """Largest rotation of slipping objects when a command of 8 N comes some time after the onset."""
    columns = [f"{kind}, {late_ms} ms" for kind in KINDS for late_ms in LATE_MS]
    print("| draw | constant force | " + " | ".join(columns) + " |")
    print("|---" * (2 + len(columns)) + "|")
    kept = True
    for index in range(count):
        config = evslip.load_config("complex", {"seed": seed, "robot.kind": robot, "slip.kind": "natural"})
        params = evslip.draw(config, index, "test")
        truth = measure(evslip.simulate(params))
        if truth.onset_us is None:
            continue
        turns = [_turned(truth)]
        for kind in KINDS:
            grip = params.grip.model_copy(update={"actuator": kind})
            for late_ms in LATE_MS:
                simulation = SteppedSimulation(params.model_copy(update={"grip": grip}))
                simulation.advance(truth.onset_us + 1000 * late_ms)
                simulation.advance(simulation.end_us, STOP_N)
                turns.append(_turned(measure(simulation.trajectory())))
        print(f"| {index} | " + " | ".join(f"{turn:.2f}" for turn in turns) + " |", flush=True)
        kept &= all(turn < turns[0] for turn in turns[1:])
    return kept


def _turned(truth: Truth) -> float:
    return float(np.ptp(truth.spin_deg[truth.held]))


GRIP_TABLES: dict[str, tuple[Callable[[int, int, str], bool], int]] = {
    "onset of a changed grip": (onset, 3),
    "creep while the grip varies": (creep, 20),
    "chatter while the grip varies": (chatter, 3),
    "slips that are stopped": (stop, 10),
}
"""Each table and how much it does without --count."""
