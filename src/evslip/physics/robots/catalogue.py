"""Robots by what the section robot of the parameters says."""

from functools import cache

from evslip.config.sections.robot import RobotSpec
from evslip.physics.robots.arms import ARMS
from evslip.physics.robots.description import Robot
from evslip.physics.robots.grippers import GRIPPERS, SMALL
from evslip.physics.robots.own import load
from evslip.utils.errors import ConfigError

OWN = {"panda": "panda", "cartesian": "panda"}
"""Gripper of each robot where none is named; of all others it is the small one."""


def robot_of(spec: RobotSpec) -> Robot:
    """The robot of these parameters. Raises ConfigError for one from a file that is not there, is wrong, or is not the
    one that it was."""
    if not spec.is_file:
        return _robot(spec.kind, spec.gripper or OWN.get(spec.kind, SMALL.name))
    found = load(spec.kind)
    if spec.sha256 not in (None, found.sha256):
        raise ConfigError(
            f"robot.sha256: {spec.kind} or a file that it names has changed: its digest is {found.sha256[:12]}..., "
            f"expected {str(spec.sha256)[:12]}...; bring the old files back, or begin a new data set"
        )
    return found.robot


def pinned(spec: RobotSpec) -> RobotSpec:
    """This robot, of a file with its digest. Raises ConfigError."""
    robot_of(spec)
    return spec if not spec.is_file else spec.model_copy(update={"sha256": load(spec.kind).sha256})


@cache
def _robot(kind: str, gripper: str) -> Robot:
    return Robot(ARMS[kind], GRIPPERS[gripper])
