"""The robot that moves the hand."""

from typing import Annotated, Literal

from pydantic import Field

from evslip.config.robot_file import SUFFIX
from evslip.config.section import LATER, OneOf, Section, wrong

ROBOTS = ("panda", "cartesian", "ur5", "xarm7")
"""`physics.robots.catalogue.ARMS` has the description of each."""
GripperName = Literal["panda", "small", "large"]
"""`physics.robots.catalogue.GRIPPERS` has the description of each."""


class RobotSpec(Section):
    """Robot that moves the hand."""

    kind: Annotated[str, OneOf(ROBOTS, SUFFIX)] = "panda"
    """The arm of a Panda, UR5 or xArm7, with its reach, limits and inertia, or a cartesian hand: an ideal one that
    follows the motion exactly and has no reach. Or a robot's file, its path ending in .toml."""
    gripper: Annotated[GripperName | None, LATER] = None
    """The Panda's hand, or a parallel gripper of two jaws with rubber pads: small (pads of 14 mm, opens to 78 mm) or
    large (pads of 22 mm, opens to 110 mm). Default: panda on panda and cartesian, small on all others. A robot's file
    has its own."""
    sha256: Annotated[str | None, Field(pattern="^[0-9a-f]{64}$"), LATER] = None
    """Digest of a robot's file and of all files that it names: with others, nothing is made. Noted by itself where a
    sample is drawn or a data set is begun."""

    @property
    def is_file(self) -> bool:
        """Whether kind is a robot's file."""
        return self.kind.endswith(SUFFIX)

    def _check(self) -> None:
        if self.is_file and self.gripper is not None:
            raise wrong("gripper", f"{self.kind} has a gripper of its own; leave this key out")
        if not self.is_file and self.sha256 is not None:
            raise wrong("sha256", f"belongs to a robot's file, and robot.kind is {self.kind!r}")
