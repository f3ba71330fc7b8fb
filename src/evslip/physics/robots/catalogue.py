"""Robots by what the section robot of the parameters says."""

from functools import cache

from evslip.config.sections.robot import RobotSpec
from evslip.physics.robots.arms import PANDA, UR5, XARM7
from evslip.physics.robots.description import Arm, Gripper, Robot
from evslip.physics.robots.grippers import LARGE, PANDA_HAND, SMALL

ARMS: dict[str, Arm | None] = {"panda": PANDA, "cartesian": None, "ur5": UR5, "xarm7": XARM7}
"""By robot.kind. None: a cartesian hand."""
GRIPPERS: dict[str, Gripper] = {gripper.name: gripper for gripper in (PANDA_HAND, SMALL, LARGE)}
"""By robot.gripper."""
OWN = {"panda": "panda", "cartesian": "panda"}
"""Gripper of each robot where none is named; of all others it is the small one."""


def robot_of(spec: RobotSpec) -> Robot:
    """The robot of these parameters."""
    return _robot(spec.kind, spec.gripper or OWN.get(spec.kind, SMALL.name))


@cache
def _robot(kind: str, gripper: str) -> Robot:
    return Robot(ARMS[kind], GRIPPERS[gripper])
