"""The robot that moves the hand."""

from typing import Literal

from evslip.config.section import Section


class RobotSpec(Section):
    """What moves the hand."""

    kind: Literal["panda", "cartesian"] = "panda"
    """The Panda's arm, with its reach, limits and inertia, or a cartesian hand: an ideal one that follows the motion
    exactly and has no reach."""
