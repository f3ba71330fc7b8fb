"""Robots from files, checked before anything is built on them."""

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from evslip.config.robot_file import RobotFile, read_robot_file
from evslip.physics.robots import hulls, urdf
from evslip.physics.robots.arms import ARMS
from evslip.physics.robots.description import TCP_M, Arm, Gripper, Robot
from evslip.physics.robots.grippers import GRIPPERS
from evslip.physics.robots.own_arm import arm_of
from evslip.physics.robots.own_gripper import gripper_of
from evslip.physics.robots.own_gripper_links import gripper_from
from evslip.utils.errors import ConfigError
from evslip.utils.files import digest, stamp_of

DOWN_DEG = 45.0
"""Largest angle between the hand at rest and straight down, ..."""
TURNED_DEG = 80.0
"""... and by which it may be turned about that."""


class Own(NamedTuple):
    robot: Robot
    sha256: str
    """Digest of the file and of all that it names."""
    assumed: tuple[str, ...]
    """Assumptions about what the file does not say."""
    stamps: dict[Path, tuple[int, int]]
    """Time of change and size of every file."""


_KNOWN: dict[tuple[Path, Path], Own] = {}
"""Robots that were read, by their files' absolute and resolved paths: read again where one of their files has changed.
Of a link both count, for what a file names lies beside the link, not beside what it leads to."""


def load(kind: str) -> Own:
    """The robot of a file. Raises ConfigError."""
    key = _key(kind)
    known = _KNOWN.get(key)
    if known is None or any(stamp_of(file) != stamp for file, stamp in known.stamps.items()):
        for read in (urdf.tree, urdf.chain, hulls.mesh_corners):
            read.cache_clear()
        known = _KNOWN[key] = _read(kind)
    return known


def _key(kind: str) -> tuple[Path, Path]:
    path = Path(kind)
    try:
        return path.absolute(), path.resolve()
    except (OSError, RuntimeError, ValueError):  # reading it says what is wrong
        return path, path


def _read(kind: str) -> Own:
    given, path = read_robot_file(kind), Path(kind)
    arm, of_arm, arm_files = _arm(given, path)
    gripper, of_gripper, gripper_files = _gripper(given, path, arm)
    camera = None
    if given.camera is not None:
        x, y, z = given.camera.place_m
        camera = (x, y, z + float(TCP_M[2]) - gripper.length_m)
    robot = Robot(arm, gripper, camera)
    if given.arm is not None and given.arm.file is not None and arm is not None:
        _check_rest(arm, gripper, path)
    files = [path.resolve(), *arm_files, *gripper_files]
    stamps = {file: stamp_of(file) for file in files}
    return Own(robot, digest(files), tuple(of_arm + of_gripper), stamps)


def _arm(given: RobotFile, path: Path) -> tuple[Arm | None, list[str], list[Path]]:
    if given.arm is None:
        return None, ["arm: none is given: a cartesian hand, which reaches everything"], []
    if given.arm.name is None:
        try:
            return arm_of(given.arm, path)
        except (ValueError, KeyError) as error:
            raise ConfigError(f"{path}: arm.file: a number or an attribute is wrong or missing: {error}") from None
    if given.arm.name not in ARMS:
        raise ConfigError(f"{path}: arm.name: {given.arm.name!r} is unknown; expected one of {', '.join(ARMS)}")
    return ARMS[given.arm.name], [], []


def _gripper(given: RobotFile, path: Path, arm: Arm | None) -> tuple[Gripper, list[str], list[Path]]:
    name = given.gripper.name
    if name is None:
        try:
            return (gripper_of if given.gripper.file is None else gripper_from)(given.gripper, path)
        except (ValueError, KeyError) as error:
            raise ConfigError(f"{path}: gripper.file: a number or an attribute is wrong or missing: {error}") from None
    if name not in GRIPPERS:
        raise ConfigError(f"{path}: gripper.name: {name!r} is unknown; expected one of {', '.join(GRIPPERS)}")
    gripper = GRIPPERS[name]
    if arm is not None and gripper.urdf not in (None, arm.urdf):
        raise ConfigError(f"{path}: gripper.name: {name!r} fits the Panda's arm or none; expected small or large")
    return gripper, [], []


def _check_rest(arm: Arm, gripper: Gripper, path: Path) -> None:
    """Raise ConfigError where the hand does not point down at rest, or is turned about that."""
    place, turn = np.zeros(3), np.eye(3)
    for link, angle in zip(urdf.chain(arm.urdf, arm.joints)[1:], arm.rest_rad, strict=True):
        spun = Rotation.from_euler("z", angle).as_matrix()
        place = place + turn @ link.origin.place
        turn = turn @ link.origin.turn @ link.axis_turn @ spun @ link.axis_turn.T
    tool = place + turn @ arm.mount_m
    turn = turn @ Rotation.from_euler("xyz", arm.mount_rpy).as_matrix()
    tool = tool + gripper.length_m * turn[:, 2]
    away = math.degrees(math.acos(np.clip(-turn[2, 2], -1.0, 1.0)))
    if away > DOWN_DEG or tool[2] < 0:
        where = ", ".join(f"{place:.3f}" for place in tool)
        raise ConfigError(
            f"{path}: arm.rest_deg: there the tool centre is at ({where}) m and the hand points {away:.0f} deg away "
            "from straight down; expected it above the table and about downwards, near where it works"
        )
    yaw = math.degrees(math.atan2(turn[1, 0], turn[0, 0]))
    if abs(yaw) > TURNED_DEG:
        raise ConfigError(
            f"{path}: arm.mount_rpy_deg: at rest the gripper's x axis is turned by {yaw:.0f} deg against the world's, "
            f"along which objects stand; turn the gripper by {yaw:.0f} deg more about z there, or the last joint"
        )
