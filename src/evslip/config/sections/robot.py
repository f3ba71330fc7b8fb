"""The robot that moves the hand."""

from typing import Annotated, Literal

from evslip.config.section import LATER, Section

RobotKind = Literal["panda", "cartesian", "ur5", "xarm7"]
"""`physics.robots.catalogue.ARMS` has the description of each."""
GripperName = Literal["panda", "small", "large"]
"""`physics.robots.catalogue.GRIPPERS` has the description of each."""


class RobotSpec(Section):
    """Robot that moves the hand."""

    kind: RobotKind = "panda"
    """The arm of a Panda, UR5 or xArm7, with its reach, limits and inertia, or a cartesian hand: an ideal one that
    follows the motion exactly and has no reach."""
    gripper: Annotated[GripperName | None, LATER] = None
    """The Panda's hand, or a parallel gripper of two jaws with rubber pads: small (pads of 14 mm, opens to 78 mm) or
    large (pads of 22 mm, opens to 110 mm). Default: panda on panda and cartesian, small on all others."""
