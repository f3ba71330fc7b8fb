"""Simulated onset of slip against onset_mass, for cylinders, meshes and objects whose mass is off their centre.

python benchmarks/shapes.py [--count 20]

Two tables: an object that hangs in a hand which does not move, at the mass at which it begins to slip; and whole
pick-and-places, at masses that must hold and that must slip.
"""

import argparse
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from fixed_hand import hang

import evslip
from evslip.config.params import Params
from evslip.physics.grip import grip_point_m
from evslip.physics.inertia import centre_of_mass_m
from evslip.physics.onset import PADS, pad_surface
from evslip.physics.scene_model import GRAVITY_M_S2
from evslip.utils.errors import GraspFailed, PlanRejected

HELD, SLIPPING = 0.85, 1.25
"""Masses, in multiples of the onset, at which every pick-and-place must hold and slip."""
BRACKET = (0.85, 1.2)
"""Where the simulated onset is looked for, in multiples of the predicted one."""
HALVINGS = 7


def make_cup(path: Path) -> None:
    """A cup with upright walls on a stem: nothing like its convex hull."""
    stem = trimesh.creation.revolve(np.array([[0, 0], [0.02, 0], [0.02, 0.002], [0.006, 0.03], [0, 0.03]]), sections=96)
    profile = [[0, 0.03], [0.025, 0.03], [0.025, 0.08], [0.022, 0.08], [0.022, 0.033], [0, 0.033]]
    trimesh.util.concatenate([stem, trimesh.creation.revolve(np.array(profile), sections=96)]).export(path)


def cases(folder: Path) -> Iterator[tuple[str, dict[str, Any]]]:
    """Names and settings of the objects, each with a few grips, forces and frictions."""
    make_cup(folder / "cup.stl")
    trimesh.creation.icosphere(subdivisions=5, radius=0.03).export(folder / "ball.stl")
    trimesh.creation.box((0.05, 0.05, 0.08)).export(folder / "box.stl")

    def mesh(name: str) -> dict[str, Any]:
        return {"object.shape": "mesh", "object.mesh": str(folder / f"{name}.stl"), "object.mesh_fit": "own"}

    cylinder = {"object.shape": "cylinder"}
    for diameter in (0.03, 0.05, 0.07):
        yield f"cylinder, {1e3 * diameter:g} mm wide", cylinder | {"object.depth_m": diameter, "object.com_x_m": 0.006}
    for depth in (-0.004, 0.004, 0.02):
        yield f"cylinder, {1e3 * depth:g} mm deep", cylinder | {"grip.depth_m": depth, "object.com_x_m": 0.006}
    for force, friction in ((2.0, 0.3), (5.0, 1.0), (20.0, 0.5)):
        changes = {"grip.force_n": force, "grip.friction": friction, "object.com_x_m": 0.006}
        yield f"cylinder, {force:g} N, friction {friction:g}", cylinder | changes
    for offset in (0.0, 0.01, 0.02):
        yield f"cuboid, mass {1e3 * offset:g} mm off", {"object.com_x_m": offset}
    yield "cuboid, mass off and gripped off", {"object.com_x_m": 0.015, "grip.offset": -0.5, "object.com_z_m": -0.02}
    for offset in (0.0, 0.006, 0.012):
        yield f"cup, mass {1e3 * offset:g} mm off", mesh("cup") | {"object.com_x_m": offset}
    yield "cup, gripped at its rim", mesh("cup") | {"object.com_x_m": 0.006, "grip.depth_m": -0.003}
    for offset in (0.0, 0.006):
        yield f"ball, mass {1e3 * offset:g} mm off", mesh("ball") | {"object.com_x_m": offset, "grip.depth_m": 0.03}
    for offset in (0.0, 0.4):
        yield f"box from a file, gripped {22.5 * offset:g} mm off", mesh("box") | {"grip.offset": offset}


def params_of(changes: dict[str, Any], index: int = 0) -> Params:
    common = {"object.width_m": 0.05, "object.height_m": 0.08, "object.mass_kg": 0.03, "grip.offset": 0.0}
    return evslip.draw(evslip.load_config("simple", common | {"grip.depth_m": 0.02} | changes), index)


def weighing(params: Params, mass_kg: float) -> Params:
    return params.model_copy(update={"object": params.object.model_copy(update={"mass_kg": mass_kg})})


def hanging_onset_kg(params: Params) -> float:
    """What limit surface and gravity alone say."""
    arm = float((centre_of_mass_m(params) - grip_point_m(params))[0])
    wrench = np.array([0.0, GRAVITY_M_S2, -arm * GRAVITY_M_S2])
    return 1 / float(pad_surface(params).utilisation(wrench, PADS * params.grip.friction * params.grip.force_n))


def simulated_ratio(params: Params, predicted_kg: float) -> float:
    """Mass at which the object begins to slip in the fixed hand, over the predicted one."""
    low, high = BRACKET
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        if hang(weighing(params, middle * predicted_kg)).slipped:
            high = middle
        else:
            low = middle
    return (low + high) / 2


def hang_table(folder: Path) -> None:
    print("| object | predicted onset, g | simulated / predicted |\n|---|---|---|")
    ratios = []
    for name, changes in cases(folder):
        params = params_of(changes)
        predicted = hanging_onset_kg(params)
        ratios.append(simulated_ratio(params, predicted))
        print(f"| {name} | {1e3 * predicted:.1f} | {ratios[-1]:.3f} |", flush=True)
    print(f"\n{len(ratios)} cases: {min(ratios):.3f} to {max(ratios):.3f}\n")


def random_changes(shape: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """A grasp of a shape, drawn evenly."""
    wide = shape.get("object.shape") == "mesh"
    return shape | {
        "object.com_x_m": float(rng.uniform(-0.01, 0.01)),
        "object.com_z_m": float(rng.uniform(-0.02, 0.01)),
        "grip.offset": float(rng.uniform(-0.2, 0.2) if wide else rng.uniform(-0.8, 0.8)),
        "grip.depth_m": float(rng.uniform(0.01, 0.025)),
        "grip.force_n": float(rng.choice([1.0, 2.0, 5.0])),
        "grip.friction": float(rng.choice([0.3, 0.5, 0.8])),
        "motion.tilt_deg": float(rng.uniform(-25, 25)),
    }


def slips(params: Params) -> bool:
    """Whether the object slips on its way; one that cannot be lifted at all does."""
    try:
        return evslip.measure(evslip.simulate(params)).onset_us is not None
    except GraspFailed:
        return True


def motion_table(folder: Path, count: int) -> None:
    print(f"| object | draws | hold at {HELD} x onset | slip at {SLIPPING} x onset |\n|---|---|---|---|")
    cup = {"object.shape": "mesh", "object.mesh": str(folder / "cup.stl"), "object.mesh_fit": "own"}
    for name, shape in (("cuboid, mass off", {}), ("cylinder", {"object.shape": "cylinder"}), ("cup", cup)):
        rng, held, slipped, made = np.random.default_rng(0), 0, 0, 0
        while made < count:
            params = params_of(random_changes(shape, rng))
            try:
                onset_kg = evslip.onset_mass(params)
                held += not slips(weighing(params, HELD * onset_kg))
                slipped += slips(weighing(params, SLIPPING * onset_kg))
            except PlanRejected:  # a grip that no hand would try
                continue
            made += 1
        print(f"| {name} | {made} | {held} | {slipped} |", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=20, help="pick-and-places of each kind of object")
    options = parser.parse_args()
    start = time.perf_counter()
    with tempfile.TemporaryDirectory() as name:
        hang_table(Path(name))
        motion_table(Path(name), options.count)
    print(f"\n{time.perf_counter() - start:.0f} s")
