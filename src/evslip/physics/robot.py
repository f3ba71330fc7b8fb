"""The Franka Panda of the package example-robot-data: inertias, limits and meshes from its URDF."""

import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from evslip.config.sections.robot import RobotKind
from evslip.physics.grip import TCP_M
from evslip.utils.errors import MissingExtraError

HOME_RAD = np.array([0.0, -0.25, 0.0, -2.35, 0.0, 2.1, 0.785])
"""Rest pose of the arm: elbow up, hand pointing down."""
HAND = "panda_hand"
ARM_JOINTS = tuple(f"panda_joint{i}" for i in range(1, 8))
MOST_SPEED_RAD_S = np.array([2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61])
MOST_ACCELERATION_RAD_S2 = np.array([15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0])
"""Limits of the arm's joints (Franka Control Interface documentation, "Robot and interface specifications": the Panda's
limits in joint space). Those of position are in the URDF."""
FINGER_JOINTS = ("panda_finger_joint1", "panda_finger_joint2")
FINGERS = ("panda_leftfinger", "panda_rightfinger")

_DESCRIPTION = "share/example-robot-data/robots/panda_description"


@dataclass(frozen=True)
class Servo:
    """A position servo: torque = stiffness * (command - position) - damping * velocity, limited."""

    stiffness: float
    damping: float
    limit: float


# Stiff enough that the arm follows within micrometres once the command leads by damping / stiffness * velocity.
ARM_SERVOS = (*[Servo(4500, 450, 87)] * 2, *[Servo(3500, 350, 87)] * 2, *[Servo(2000, 200, 12)] * 3)
ARM_ARMATURE = 0.1
FINGER_STIFFNESS, FINGER_DAMPING = 4000.0, 60.0
FINGER_JOINT_DAMPING = 5.0
CARTESIAN_JOINTS = ("hand_x", "hand_y", "hand_z", "hand_tilt")
CARTESIAN_INERTIA = (100.0, 100.0, 100.0, 1.0)
"""In kg and kg m2: so heavy that nothing that it holds moves it."""
CARTESIAN_RATE_RAD_S = 200.0
"""Natural frequency of the critically damped servos."""


def description_folder() -> Path:
    """Folder of the Panda's URDF and meshes. Raises MissingExtraError."""
    try:
        root = Path(str(metadata.distribution("example-robot-data").locate_file("")))
    except metadata.PackageNotFoundError:
        raise MissingExtraError("the Panda model is missing; pip install example-robot-data") from None
    candidates = [root / "cmeel.prefix" / _DESCRIPTION, *(parent / _DESCRIPTION for parent in root.parents)]
    for folder in candidates:
        if (folder / "urdf" / "panda.urdf").is_file():
            return folder
    raise MissingExtraError(f"example-robot-data is installed, but {_DESCRIPTION} is not in it; reinstall it")


@cache
def collision_hull(link: str) -> np.ndarray:
    """Corners of a link's collision mesh in the link's frame, in metres, of shape (n, 3).

    `link` is link0 to link7, hand or finger. The meshes are convex."""
    triangle = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    data = (description_folder() / "meshes" / "collision" / f"{link}.stl").read_bytes()
    corners = np.frombuffer(data, triangle, offset=84)["corners"].reshape(-1, 3)
    return np.unique(corners, axis=0).astype(np.float64)


@cache
def _bare_urdf(base: str) -> str:
    """The URDF from link `base` on, without geometry: MuJoCo loads it without looking for mesh files."""
    root = ET.parse(description_folder() / "urdf" / "panda.urdf").getroot()
    joints = list(root.iter("joint"))
    parents = {_link(joint, "child"): _link(joint, "parent") for joint in joints}

    def kept(link: str) -> bool:
        return link == base or (link in parents and kept(parents[link]))

    for link in root.findall("link"):
        for part in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(part)
        if not kept(link.attrib["name"]):
            root.remove(link)
    for joint in joints:
        if not kept(_link(joint, "parent")):
            root.remove(joint)
    extension = ET.SubElement(root, "mujoco")
    ET.SubElement(extension, "compiler", fusestatic="false", autolimits="true")
    return ET.tostring(root, encoding="unicode")


def _link(joint: ET.Element, end: str) -> str:
    part = joint.find(end)
    return "" if part is None else part.attrib["link"]


def panda(grip_force_n: float) -> Any:
    """A mujoco.MjSpec of the arm and hand without any geometry, weightless, with servos on every joint.

    Each finger pushes with at most `grip_force_n`, so a finger that closes into an object presses with exactly that.
    """
    spec = _weightless("panda_link0")
    for name, servo in zip(ARM_JOINTS, ARM_SERVOS, strict=True):
        spec.joint(name).armature = ARM_ARMATURE
        _add_servo(spec, name, servo)
    add_finger_servos(spec, grip_force_n)
    return spec


def cartesian_hand(grip_force_n: float) -> Any:
    """A mujoco.MjSpec of the hand on three slides and a hinge: an ideal robot. Its joints are the tool centre's x, y, z
    and the tilt about the closing axis."""
    spec = hand()
    slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
    axes = np.diag([1, -1, -1])[[0, 1, 2, 1]]  # in the frame of the hand, which points down
    for name, kind, axis, inertia in zip(
        CARTESIAN_JOINTS, (slide, slide, slide, hinge), axes, CARTESIAN_INERTIA, strict=True
    ):
        spec.body(HAND).add_joint(name=name, type=kind, axis=axis, pos=TCP_M, armature=inertia)
        rate = CARTESIAN_RATE_RAD_S
        _add_servo(spec, name, Servo(inertia * rate**2, 2 * inertia * rate, np.inf))
    add_finger_servos(spec, grip_force_n)
    return spec


def hand() -> Any:
    """A mujoco.MjSpec of the hand alone, pointing down, its tool centre at the origin, without servos."""
    spec = _weightless(HAND)
    spec.body(HAND).pos, spec.body(HAND).quat = TCP_M, [0, 1, 0, 0]
    return spec


def _weightless(base: str) -> Any:
    spec = mujoco.MjSpec.from_string(_bare_urdf(base))
    for body in spec.bodies[1:]:
        body.gravcomp = 1
    return spec


def add_finger_servos(spec: Any, grip_force_n: float) -> None:
    """Let each finger push with at most `grip_force_n`."""
    for name in FINGER_JOINTS:
        joint = spec.joint(name)
        joint.damping[0] = FINGER_JOINT_DAMPING
        joint.armature = 0.1
        joint.range = [-0.002, 0.04]
        _add_servo(spec, name, Servo(FINGER_STIFFNESS, FINGER_DAMPING, grip_force_n))


def _add_servo(spec: Any, joint: str, servo: Servo) -> None:
    kinds = {"gaintype": mujoco.mjtGain.mjGAIN_FIXED, "biastype": mujoco.mjtBias.mjBIAS_AFFINE}
    actuator = spec.add_actuator(name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT, **kinds)
    actuator.gainprm[0] = servo.stiffness
    actuator.biasprm[:3] = [0, -servo.stiffness, -servo.damping]
    actuator.forcelimited = int(np.isfinite(servo.limit))
    if actuator.forcelimited:
        actuator.forcerange = [-servo.limit, servo.limit]
    actuator.ctrllimited = 0


ROBOTS: dict[RobotKind, Callable[[float], Any]] = {"panda": panda, "cartesian": cartesian_hand}
"""Makers of what moves the hand, by the name in robot.kind; each takes the grip force in newtons."""
