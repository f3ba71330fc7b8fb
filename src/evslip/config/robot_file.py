"""Schema of a robot's file, TOML, which `robot.kind` may name. docs/reference/robot-file.md explains every key.

Lengths are in metres. Places of a gripper's parts are in the frame of the face that it is mounted with: z points to the
tool, the fingers close along y, and they are closed, so that the pads touch at y = 0.
"""

from typing import Annotated, Literal

from pydantic import AllowInfNan, Field, Strict, ValidationError

from evslip.config.explanation import explain
from evslip.config.section import Section, Within, wrong
from evslip.utils.errors import ConfigError, DataError
from evslip.utils.toml import read_toml

SUFFIX, FORMAT = ".toml", "evslip robot"
Number = Annotated[float, Strict(), AllowInfNan(False)]
Vector = tuple[Number, Number, Number]
METRES = "lengths are in metres; is this in millimetres?"


class BoxFile(Section):
    """A box of a gripper."""

    centre_m: Annotated[Vector, Within(-1.0, 1.0, METRES)]
    size_m: Annotated[Vector, Within(1e-4, 0.5, METRES)]
    """Its sides."""
    turn_deg: Annotated[Vector, Within(-360.0, 360.0)] = (0.0, 0.0, 0.0)
    """Roll, pitch and yaw."""
    albedo: Annotated[Number, Within(0.0, 1.0)] = 0.5
    """Share of light that it reflects."""


class PartFile(Section):
    """The palm or a finger."""

    boxes: Annotated[tuple[BoxFile, ...], Field(min_length=1, max_length=16)]
    """Boxes that throw its shadow, and are seen where there is no mesh."""
    mesh: str | None = None
    """File of what is seen, beside this one; its frame is that of the boxes."""
    mesh_scale: Annotated[Number, Within(1e-6, 1e3)] = 1.0
    """Metres by unit of that file."""
    mass_kg: Annotated[Number | None, Within(1e-3, 20.0)] = None
    """Default: that of the boxes at 1500 kg/m3."""


class PadsFile(Section):
    """The square rubber pads of both fingers, alike."""

    z_m: Annotated[Number, Within(0.01, 0.5, METRES)]
    """Place of their middle: the tool centre is (0, 0, z_m)."""
    size_m: Annotated[Number, Within(0.004, 0.04, METRES)]
    """Their side."""
    thickness_m: Annotated[Number, Within(2e-4, 0.01, METRES)] = 0.002
    stiffness_pa_m: Annotated[Number, Within(1e7, 1e11)] = 1e9
    """Pressure by depth of indentation."""
    friction: Annotated[tuple[Number, Number], Within(0.05, 2.0)] = (0.05, 2.0)
    """Least and largest grip.friction that these pads can have with an object."""


PARTS = ("palm", "left", "right")
OF_PARTS = ("pads", "palm", "left", "stroke_m", "force_n")
FROM_FILE = ("file", "base", "joints", "pads", "force_n")
"""Keys that a gripper must have."""


class GripperFile(Section):
    """A gripper of two fingers that slide along y: built in, by its name, from a URDF or MJCF, or of parts."""

    name: str | None = None
    file: str | None = None
    """URDF or MJCF, beside this file."""
    base: str | None = None
    """Its link (URDF) or body (MJCF) that is the palm."""
    joints: Annotated[tuple[str, ...] | None, Field(min_length=2, max_length=2)] = None
    """Its sliding joints that open the left and the right finger."""
    mount_m: Annotated[Vector, Within(-1.0, 1.0, METRES)] = (0.0, 0.0, 0.0)
    """Place of the face that it is mounted with, in the frame of the base."""
    mount_rpy_deg: Annotated[Vector, Within(-360.0, 360.0)] = (0.0, 0.0, 0.0)
    """Roll, pitch and yaw of that face."""
    pads: PadsFile | None = None
    palm: PartFile | None = None
    left: PartFile | None = None
    """The finger at y > 0."""
    right: PartFile | None = None
    """The finger at y < 0; default: the left one, turned by half a turn about z."""
    stroke_m: Annotated[Number | None, Within(0.003, 0.15, METRES)] = None
    """Way that each finger opens; default, from a file: as far as its joints go."""
    force_n: Annotated[tuple[Number, Number] | None, Within(0.1, 70.0)] = None
    """Least and largest grip force."""

    def _check(self) -> None:
        if self.name is not None:
            if self.model_fields_set != {"name"}:
                raise wrong("name", "a gripper that is built in has no other keys; leave them out, or the name")
            return
        kind, needed, foreign = (
            ("of parts", OF_PARTS, FROM_FILE) if self.file is None else ("from a file", FROM_FILE, PARTS)
        )
        for key in needed:
            if getattr(self, key) is None:
                raise wrong(key, f"this key is missing; a gripper {kind} has {', '.join(needed)}")
        for key in foreign:
            if key not in needed and key in self.model_fields_set:
                raise wrong(key, f"a gripper {kind} has no such key; expected {', '.join(needed)}")


class ArmFile(Section):
    """An arm: built in, by its name, or from a file. Lists have an entry a joint, from the base on."""

    name: str | None = None
    file: str | None = None
    """URDF or MJCF, beside this file; it is seen as its collision shapes, or as what else it has."""
    flange: str | None = None
    """Link (URDF) or body (MJCF) that carries the gripper."""
    mount_m: Annotated[Vector, Within(-1.0, 1.0, METRES)] = (0.0, 0.0, 0.0)
    """Place of the face that the gripper is mounted on, in the frame of the flange."""
    mount_rpy_deg: Annotated[Vector, Within(-360.0, 360.0)] = (0.0, 0.0, 0.0)
    """Roll, pitch and yaw of that face."""
    rest_deg: tuple[Number, ...] | None = None
    """Rest pose, in which the hand points down: of all poses for a place, the arm takes the one nearest to it."""
    torque_n_m: Annotated[tuple[Number, ...] | None, Within(0.1, 1e4)] = None
    """Largest torques; default: the file's."""
    speed_deg_s: Annotated[tuple[Number, ...] | None, Within(1.0, 1e4)] = None
    """Largest speeds; default: the file's."""
    acceleration_deg_s2: Annotated[tuple[Number, ...] | None, Within(1.0, 1e6)] = None
    """Largest accelerations; default: 860, an assumption."""

    def _check(self) -> None:
        if (self.name is None) == (self.file is None):
            raise wrong("name", "an arm has either a name, of one that is built in, or a file, URDF or MJCF")
        if self.name is not None and self.model_fields_set != {"name"}:
            raise wrong("name", "an arm that is built in has no other keys; leave them out, or the name")
        for key in ("flange", "rest_deg") if self.file is not None else ():
            if getattr(self, key) is None:
                raise wrong(key, "this key is missing; an arm from a file has file, flange, rest_deg")


class CameraFile(Section):
    """The camera of `camera.mount = "robot"`, which looks at the tool centre."""

    place_m: Annotated[Vector, Within(-1.0, 1.0, METRES)]
    """In the gripper's frame."""


class RobotFile(Section):
    """All of a robot's file."""

    format: Literal["evslip robot"]
    version: Literal[1]
    arm: ArmFile | None = None
    """None: a cartesian hand."""
    gripper: GripperFile
    camera: CameraFile | None = None


def read_robot_file(path: str) -> RobotFile:
    """Content of a robot's file. Raises ConfigError."""
    try:
        tree = read_toml(path)
    except (DataError, ValueError) as error:
        text = str(error)
        raise ConfigError(text if text.startswith(path) else f"{path}: not valid TOML: {text}") from None
    if tree.get("format") != FORMAT:
        raise ConfigError(f'{path}: is no robot; its first lines are expected to be format = "{FORMAT}", version = 1')
    try:
        return RobotFile.model_validate(tree)
    except ValidationError as error:
        raise ConfigError(f"{path}: {explain(error, RobotFile)}") from None
