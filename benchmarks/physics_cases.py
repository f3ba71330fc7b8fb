"""Cases of the physics benchmarks, and the bounds that they are to keep."""

import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
from fixed_hand import hang
from scipy.spatial.transform import Rotation

import evslip
from evslip.config.params import Params
from evslip.physics import scene_model
from evslip.physics.grip import grip_point_m
from evslip.physics.inertia import centre_of_mass_m
from evslip.physics.onset import PADS, pad_surface
from evslip.physics.truth import Truth

RATIO = 0.97, 1.03
"""Simulated over predicted onset mass."""
CREEP_DEG, CREEP_MM = 0.01, 0.06
"""Movement of a held object within a window ..."""
WINDOW_S = 0.16
"""... of this length."""
ROBOTS = ("panda", "cartesian", "ur5-small", "ur5-large", "xarm7-small", "xarm7-large")
"""Kinds of robots with their grippers."""
CUBOID = {"object.width_m": 0.05, "object.depth_m": 0.05, "object.height_m": 0.1}
VARIED = {
    "grip.force_n": {"min": 1.0, "max": 10.0},
    "grip.friction": {"min": 0.3, "max": 1.0},
    "motion.tilt_deg": {"min": -25.0, "max": 25.0},
}
"""What the random draws vary beyond preset complex."""


def gripped(depth_mm: float, offset_mm: float, force_n: float, friction: float) -> dict[str, Any]:
    """Overrides that grip CUBOID there."""
    share = offset_mm / (900 * CUBOID["object.width_m"] / 2)
    return {"grip.depth_m": depth_mm / 1e3, "grip.offset": share, "grip.force_n": force_n, "grip.friction": friction}


def hanging_onset_kg(params: Params) -> float:
    """Mass at which an object at rest must slip."""
    arm, _ = centre_of_mass_m(params) - grip_point_m(params)
    weight = scene_model.GRAVITY_M_S2 * np.array([0.0, 1.0, -arm])
    return float(1 / pad_surface(params).utilisation(weight, PADS * params.grip.friction * params.grip.force_n))


def bisected(params: Params, low: float = 0.8, high: float = 1.25, regrip_n: float | None = None) -> float:
    """Simulated over predicted onset mass of an object that hangs at rest, in a grip that has gone to regrip_n."""
    predicted = hanging_onset_kg(params) * (1.0 if regrip_n is None else regrip_n / params.grip.force_n)
    while high - low > 0.002:
        middle = (low + high) / 2
        low, high = (
            (low, middle) if hang(weighing(params, middle * predicted), regrip_n=regrip_n).slipped else (middle, high)
        )
    return (low + high) / 2


def robot_keys(robot: str) -> dict[str, str]:
    """Overrides that choose a robot by its kind, or kind-gripper, or by its file."""
    kind, _, gripper = (robot, "", "") if robot.endswith(".toml") else robot.partition("-")
    return {"robot.kind": kind} | ({"robot.gripper": gripper} if gripper else {})


def params_of(index: int, seed: int, robot: str, overrides: dict[str, Any]) -> Params:
    """A draw of preset complex. robot: as of robot_keys."""
    config = evslip.load_config("complex", {"seed": seed, **robot_keys(robot), **overrides})
    return evslip.draw(config, index)


def weighing(params: Params, mass_kg: float) -> Params:
    """The same sample with another mass."""
    return params.model_copy(update={"object": params.object.model_copy(update={"mass_kg": mass_kg})})


def largest_creep(truth: Truth) -> tuple[float, float]:
    """Largest rotation in degrees and translation in millimetres within a held window."""
    span = round(WINDOW_S / scene_model.TIMESTEP_S)
    turn = Rotation.from_quat(truth.rotation[truth.held].astype(np.float64), scalar_first=True)
    place = truth.position_m[truth.held].astype(np.float64)
    turned = np.degrees((turn[:-span].inv() * turn[span:]).magnitude())
    return float(turned.max()), 1e3 * float(np.linalg.norm(place[span:] - place[:-span], axis=1).max())


def progress(work: Any) -> Iterator[Any]:
    """Walk through a sequence, telling on the error stream how far it is."""
    for number, item in enumerate(work):
        if number and number % 20 == 0:
            print(f"  {number} of {len(work)}", file=sys.stderr, flush=True)
        yield item
