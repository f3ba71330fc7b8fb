"""Description of a robot: what physics and both renderers know of an arm and of its gripper.

The frame of every hand is the same: its tool centre, the middle between the pads, lies at TCP_M, z points to the
tool, and the fingers close along y. A pad is the square of its half side around the tool centre. The frame of a finger
lies at FINGER_Z_M, with the face of the pad at y = 0 and the finger at y > 0; the right finger's is turned by half a
turn about z.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from evslip.scene.shapes.surface import BOX_CORNERS

Vector = tuple[float, float, float]
TCP_M = np.array([0.0, 0.0, 0.1034])
"""Tool centre, the middle between the pads, in the frame of the hand; in the Panda's, panda_hand, it lies there."""
FINGER_Z_M = 0.0584
"""Origin of the finger frames in the hand frame, that of the Panda's finger joints."""
MOST_JOINTS = 7
"""Columns of a record that hold joints of an arm."""
STRAIGHT: tuple[Vector, Vector, Vector] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Servo:
    """A position servo: torque = stiffness * (command - position) - damping * velocity, limited."""

    stiffness: float
    damping: float
    limit: float


@dataclass(frozen=True)
class Arm:
    """An arm of revolute joints in a row, from its URDF."""

    name: str
    """Name in messages."""
    urdf: Path
    """File, or its place in the package example-robot-data."""
    joints: tuple[str, ...]
    """From the base on."""
    flange: str
    """Link that carries the hand; the last of the joints moves it."""
    mount_m: Vector
    """Place of the face on which a gripper is mounted, in the frame of that link."""
    mount_rpy: Vector
    """Roll, pitch and yaw of that face, in radians: its z points to the tool, the fingers close along its y."""
    servos: tuple[Servo, ...]
    rest_rad: tuple[float, ...]
    """Rest pose, hand pointing down: where a pose leaves a joint free, the arm stays near it."""
    most_speed_rad_s: tuple[float, ...]
    most_acceleration_rad_s2: tuple[float, ...]
    reach_m: tuple[float, float]
    """Distances from the base between which a path is likely to be reached; for messages."""
    left_out: tuple[str, ...] = ()
    """Links that the URDF has besides, with all that they carry: a hand, in whose place another gripper comes."""
    content: str = ""
    """Digest of the URDF and its meshes, of an arm from outside: with another, it is another arm."""


@dataclass(frozen=True)
class Box:
    """A box in the frame of the hand or the left finger."""

    place_m: Vector
    """Its centre."""
    half_m: Vector
    """Half its sides, along its own axes."""
    axes: tuple[Vector, Vector, Vector] = STRAIGHT
    """Rows of the matrix whose columns are its axes."""
    albedo: float = 0.5
    """Share of light that it reflects, where it is seen itself."""


@dataclass(frozen=True)
class Look:
    """A mesh file or a convex body that is seen, placed in the frame of a part."""

    file: Path | None
    """As `Arm.urdf`; None for a body."""
    place_m: Vector = (0.0, 0.0, 0.0)
    axes: tuple[Vector, Vector, Vector] = STRAIGHT
    """As of `Box`."""
    scale: Vector = (1.0, 1.0, 1.0)
    """Metres by unit of the file, along its axes."""
    corners_m: tuple[Vector, ...] = ()
    """Corners of the body, in its own frame."""
    colour: Vector | None = None
    """Colour of the body, or of the mesh in place of the file's own, sRGB of 0 to 1."""
    content: str = ""
    """As of `Arm`."""


@dataclass(frozen=True)
class Part:
    """The palm or a finger."""

    boxes: tuple[Box, ...]
    """Boxes that throw its shadow, and are seen where it has no looks."""
    blocker: Box
    """A coarse box that keeps light from all around away."""
    looks: tuple[Look, ...] = ()
    """Visible surfaces."""
    hull: Path | None = None
    """Convex mesh (STL) that must not touch the table; as `Arm.urdf`. None: the boxes."""
    mass_kg: float = 0.0


@dataclass(frozen=True)
class Gripper:
    """A hand with two fingers that slide along y."""

    name: str
    """In robot.gripper."""
    palm: Part
    finger: Part
    """The left one, and the right one unless that is given."""
    pad_half_m: float
    """Half side of its square pads."""
    stroke_m: float
    """Travel of each finger when wide open."""
    most_n: float
    """Largest grip force."""
    length_m: float
    """From the face that it is mounted with to the tool centre."""
    pad_stiffness_pa_m: float = 1e9
    """Pressure of the pads by depth of indentation. An assumption: 2 mm of silicone rubber of Young's modulus 2 MPa."""
    right: Part | None = None
    least_n: float = 0.0
    """Smallest grip force."""
    friction: tuple[float, float] = (0.0, math.inf)
    """Least and largest coefficient of friction that the pads can have with an object."""
    hand: str = "hand"
    """Names of its bodies and joints in the model, and in its URDF, if it has one."""
    fingers: tuple[str, str] = ("left_finger", "right_finger")
    finger_joints: tuple[str, str] = ("left_finger_joint", "right_finger_joint")
    urdf: Path | None = None
    """Inertias of a hand that is part of an arm's URDF; as `Arm.urdf`."""

    @property
    def jaws(self) -> tuple[Part, Part]:
        """The left and the right finger, each in its own frame."""
        return self.finger, self.right or self.finger


@dataclass(frozen=True)
class Robot:
    """An arm, or nothing in place of it, and the hand."""

    arm: Arm | None
    """None: a cartesian hand."""
    gripper: Gripper
    camera_m: Vector | None = None
    """Place of the camera whose mount is "robot", in the frame of the hand."""


def corners_of(boxes: tuple[Box, ...]) -> np.ndarray:
    """Corners of boxes in the frame of their part, in metres, of shape (8 n, 3)."""
    return np.concatenate([box.place_m + (BOX_CORNERS * box.half_m) @ np.array(box.axes).T for box in boxes])
