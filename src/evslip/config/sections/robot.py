"""The robot that moves the hand."""

from typing import Literal

from evslip.config.section import Section

RobotKind = Literal["panda", "cartesian"]
"""`physics.robot.ROBOTS` has the model of each, `physics.motion.servo_plan.FOLLOW` how it follows a path."""


class RobotSpec(Section):
    """Robot that moves the hand."""

    kind: RobotKind = "panda"
    """The Panda's arm, with its reach, limits and inertia, or a cartesian hand: an ideal one that follows the motion
    exactly and has no reach."""
