"""Every parameter of a sample, with its unit and its limits.

The same fields serve twice: in a `Config` a field may hold a distribution, in `Params` it holds the value drawn.
"""

from dataclasses import dataclass
from typing import Annotated, Any, Generic, Literal, TypeVar

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, RootModel, Strict, model_validator
from pydantic_core import PydanticCustomError

from evslip.config.distributions import extremes
from evslip.scene.shapes import SHAPES

N = TypeVar("N")
"""Number in Params, distribution in a Config."""
S = TypeVar("S")
"""Name in Params, name or choices in a Config."""


def usual(value: float | str) -> Any:
    """A default, typed so that it fits values and distributions alike."""
    return value


@dataclass(frozen=True)
class Within:
    """Physical limits of a field; checked at both ends of a distribution."""

    low: float
    high: float
    reason: str = ""


def _wrong(key: str, expected: str) -> PydanticCustomError:
    """An error of one field of a section, as `evslip.config.explanation.explain` tells it."""
    return PydanticCustomError("within", "{key}|{expected}", {"key": key, "expected": expected})


@dataclass(frozen=True)
class OneOf:
    """The names that a field may hold."""

    names: tuple[str, ...]


class Section(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    @model_validator(mode="after")
    def _check_limits(self) -> "Section":
        for name, field in type(self).model_fields.items():
            for limit in field.metadata:
                value: Any = getattr(self, name)
                if isinstance(limit, OneOf):
                    for choice in value if isinstance(value, tuple) else (value,):
                        if choice not in limit.names:
                            expected = f"{choice!r} is unknown; expected one of {', '.join(limit.names)}"
                            raise _wrong(name, expected)
                if isinstance(limit, Within) and value is not None:
                    low, high = extremes(value)
                    if low < limit.low or high > limit.high:
                        bad = low if low < limit.low else high
                        reason = f"; {limit.reason}" if limit.reason else ""
                        expected = f"{bad:g} is out of range, expected {limit.low:g} to {limit.high:g}{reason}"
                        raise _wrong(name, expected)
        return self


class ObjectSpec(Section, Generic[N, S]):
    """The object. At the start its sides are parallel to the table's axes; its depth is the gripped side."""

    shape: Annotated[S, OneOf(tuple(SHAPES))] = usual("cuboid")
    """cuboid, cylinder (upright, round: its diameter is depth_m, and width_m follows) or mesh (a file)."""
    mesh: S | None = None
    """Path of a watertight mesh (.stl .ply .obj .off .glb .gltf .dae), z up; for shape mesh alone."""
    mesh_fit: Annotated[S, OneOf(("stretch", "height", "own"))] = usual("stretch")
    """Stretch: the mesh's bounding box becomes width_m x depth_m x height_m. Height: scaled evenly to height_m. Own:
    the file is in metres. The dimensions that result replace the ones drawn."""
    width_m: Annotated[N, Within(0.01, 0.2)]
    """Size along world x, in the image plane of the side camera."""
    depth_m: Annotated[N, Within(0.005, 0.075, "the hand opens to 0.08 m")]
    """Size along world y, between the pads; the hand opens to 0.08 m."""
    height_m: Annotated[N, Within(0.02, 0.25)]
    """Size along world z."""
    mass_kg: Annotated[N, Within(0.001, 2.0)]
    """Mass."""
    density_kg_m3: Annotated[N | None, Within(1.0, 25000.0)] = None
    """If given, the mass is this times the object's volume, and replaces mass_kg."""
    com_x_m: Annotated[N, Within(-0.1, 0.1)] = usual(0.0)
    """Centre of mass, from where it is when the object is evenly filled: along the width,"""
    com_y_m: Annotated[N, Within(-0.1, 0.1)] = usual(0.0)
    """... along the depth, between the pads,"""
    com_z_m: Annotated[N, Within(-0.125, 0.125)] = usual(0.0)
    """... and upwards."""
    x_m: Annotated[N, Within(-1.0, 1.0)]
    """Centre on the table, along the robot's forward axis."""
    y_m: Annotated[N, Within(-1.0, 1.0)]
    """Centre on the table, to the robot's left."""
    texture: S
    """Name of a texture of the pool, or path of an image; patterns and folders are drawn from."""


class GripSpec(Section, Generic[N, S]):
    """Where and how hard the hand grips."""

    offset: Annotated[N, Within(-1.0, 1.0)]
    """Gripping point along the width, as a share of 0.9 x half width; 0 is the middle."""
    depth_m: Annotated[N, Within(-0.0075, 0.05)]
    """Tool centre below the top edge; negative is above it, where the pads still overlap the object."""
    force_n: Annotated[N, Within(0.1, 70.0)]
    """Normal force of each pad."""
    friction: Annotated[N, Within(0.05, 2.0)]
    """Coulomb friction coefficient between pad and object."""
    error_x_m: Annotated[N, Within(-0.03, 0.03)] = usual(0.0)
    """How far the object stands from where the hand takes it to be: along its width,"""
    error_y_m: Annotated[N, Within(-0.03, 0.03)] = usual(0.0)
    """... along its depth: the fingers push it into their middle,"""
    error_yaw_deg: Annotated[N, Within(-20.0, 20.0)] = usual(0.0)
    """... and turned about the vertical: the pads give way to it, and turn it straight only where friction is low."""


class SurfaceSpec(Section, Generic[N, S]):
    """The table: a plane at z = 0."""

    texture: S
    """Name of a texture of the pool, or path of an image; patterns and folders are drawn from."""
    tile_m: Annotated[N, Within(0.01, 10.0)]
    """Side of one repetition of the texture."""


class BackgroundSpec(Section, Generic[N, S]):
    """The sphere around the scene: background and ambient light."""

    texture: S
    """As object.texture, and the pool's panoramas; an image twice as wide as high is a panorama, too."""
    luminance_cd_m2: Annotated[N, Within(0.0, 1e7)]
    """Luminance where the texture is white."""
    radius_m: Annotated[N, Within(5.0, 1000.0)]
    """Radius, about the world's origin."""
    tile_deg: Annotated[N, Within(1.0, 360.0)]
    """Angle that one repetition of the texture covers, seen from the centre; a panorama covers all."""


class LightSpec(Section, Generic[N, S]):
    """A luminous sphere above the table: casts the shadows."""

    luminance_cd_m2: Annotated[N, Within(0.0, 1e10)]
    """Luminance of its surface."""
    radius_m: Annotated[N, Within(0.001, 10.0)]
    """Its own radius: larger is brighter, with softer shadows."""
    distance_m: Annotated[N, Within(1.0, 1000.0)]
    """From the world's origin to its centre."""
    azimuth_deg: Annotated[N, Within(-360.0, 360.0)]
    """About world z, from the x axis."""
    polar_deg: Annotated[N, Within(0.0, 90.0)]
    """From the zenith: 0 overhead, 90 at the horizon. Lights spread evenly over the hemisphere: { min = 0.0,
    max = 90.0, law = "sphere" }."""


class Waypoint(Section):
    """Where the hand rests on its way, counted from where the lift has put it."""

    x_m: Annotated[float, Strict(), Within(-1.0, 1.0)] = 0.0
    y_m: Annotated[float, Strict(), Within(-1.0, 1.0)] = 0.0
    z_m: Annotated[float, Strict(), Within(-1.0, 1.0)] = 0.0
    tilt_deg: Annotated[float, Strict(), Within(-60.0, 60.0)] = 0.0
    """Lateral tilt, about the closing axis."""
    time_s: Annotated[float, Strict(), Within(0.05, 60.0)] = 1.0
    """Time that the way there takes."""

    @property
    def place_m(self) -> np.ndarray:
        """Position, of shape (3,)."""
        return np.array([self.x_m, self.y_m, self.z_m])


class Waypoints(RootModel[tuple[Waypoint, ...]]):
    """The way from the lift to the placement. Not a list of choices: a sample visits all of them."""

    model_config = ConfigDict(frozen=True)

    @model_validator(mode="after")
    def _check_end(self) -> "Waypoints":
        if self.root and self.root[-1].tilt_deg != 0:
            raise ValueError("the last way-point needs tilt_deg = 0, so that the object can be set down")
        return self


class RobotSpec(Section):
    """What moves the hand."""

    kind: Literal["panda", "cartesian"] = "panda"
    """The Panda's arm, with its reach, limits and inertia, or a cartesian hand: an ideal one that follows the motion
    exactly and has no reach."""


class MotionSpec(Section, Generic[N, S]):
    """What the hand does: approach, grasp, lift, the motion of its kind, place, release."""

    kind: Literal["pick_and_place", "hold", "shake", "rotate", "waypoints"] = "pick_and_place"
    """Between lift and placement: tilt while moving to the goal and back upright, hold still, shake along an axis, turn
    to either side, or visit way-points."""
    duration_s: Annotated[N, Within(3.0, 60.0)]
    """Whole length of the pick-and-place. All times scale with it, except those given below, which lengthen or shorten
    the whole."""
    lift_m: Annotated[N, Within(0.0, 0.5)]
    """Height of the lift."""
    move_x_m: Annotated[N, Within(-1.0, 1.0)]
    """Way to the goal along world x, of pick_and_place."""
    move_y_m: Annotated[N, Within(-1.0, 1.0)]
    """Way to the goal along world y, of pick_and_place."""
    tilt_deg: Annotated[N, Within(-60.0, 60.0)]
    """Largest lateral tilt, about the closing axis; of pick_and_place and rotate."""
    lift_s: Annotated[N | None, Within(0.1, 60.0)] = None
    """Time of the lift. Default: 0.8 of 7.5 parts of duration_s."""
    tilt_s: Annotated[N | None, Within(0.1, 60.0)] = None
    """Time to reach the tilt, again for the way back, and of each swing of rotate. Default: 1.4 of 7.5 parts."""
    lower_s: Annotated[N | None, Within(0.1, 60.0)] = None
    """Time of lowering. Default: 1.2 of 7.5 parts."""
    hold_s: Annotated[N, Within(0.1, 600.0)] = usual(3.0)
    """Time that hold keeps the object up."""
    amplitude_m: Annotated[N, Within(0.0, 0.2)] = usual(0.03)
    """Largest way to either side of shake."""
    frequency_hz: Annotated[N, Within(0.1, 5.0)] = usual(1.5)
    """Oscillations a second of shake."""
    axis: Literal["x", "y", "z"] = "z"
    """Axis of the world along which shake moves."""
    cycles: Annotated[int, Strict(), Within(1, 1000)] = 3
    """Oscillations of shake and rotate."""
    waypoints: Waypoints | None = None
    """Of waypoints: a list such as [{ y_m = -0.1, z_m = 0.05, tilt_deg = 20.0, time_s = 1.5 }, { y_m = -0.2 }], counted
    from where the lift ends; the object is set down below the last."""

    @model_validator(mode="after")
    def _check_waypoints(self) -> "MotionSpec[N, S]":
        if (self.kind == "waypoints") != bool(self.waypoints and self.waypoints.root):
            expected = (
                "needs motion.kind = 'waypoints'" if self.waypoints else "is missing, motion.kind 'waypoints' needs it"
            )
            raise _wrong("waypoints", expected)
        return self


NATURAL, HOLD = "natural", "hold"
SLIP_KINDS = (NATURAL, HOLD, "rotation", "translation", "lift", "tilt", "placement", "creep", "drop")


class SlipSpec(Section, Generic[N, S]):
    """Slip on purpose."""

    kind: S = usual("natural")
    """Natural: as object.mass_kg has it. Hold: none. Rotation, translation: of this form. Lift, tilt, placement: in
    this phase. Creep: slowly. Drop: out of the hand. All but natural choose the mass and, where they must, grip and
    motion. Of a list every sample has one, at random."""
    multiple: Annotated[N | None, Within(0.01, 20.0)] = None
    """Mass as a multiple of the onset mass, over the phases of the kind. Default: the kind's own."""

    @model_validator(mode="after")
    def _check_kind(self) -> "SlipSpec[N, S]":
        kind: Any = self.kind
        for name in kind if isinstance(kind, tuple) else (kind,):
            if name not in SLIP_KINDS:
                raise _wrong("kind", f"{name!r} is unknown, expected one of {', '.join(SLIP_KINDS)}")
        if kind == NATURAL and self.multiple is not None:
            raise _wrong("multiple", "needs a slip.kind other than natural")
        return self


class CameraSpec(Section, Generic[N, S]):
    """The event camera, fixed to the hand."""

    mount: Annotated[S, OneOf(("side", "front", "custom"))] = usual("side")
    """Side: looks along the closing axis, a rotating slip lies in the image plane. Front: across it. Custom: at x_m,
    y_m, z_m, looks at the tool centre."""
    x_m: Annotated[N, Within(-0.5, 0.5)] = usual(0.0)
    """Position in the hand's frame, added to the mount's, which is (0, 0.27, 0.13) for side, (0.27, 0, 0.13) for front
    and 0 for custom: in the image plane of side,"""
    y_m: Annotated[N, Within(-0.5, 0.5)] = usual(0.0)
    """... along the closing axis,"""
    z_m: Annotated[N, Within(-0.5, 0.5)] = usual(0.0)
    """... and the way that the fingers point; the tool centre is at 0.1034. A small range of each is a jitter."""
    yaw_deg: Annotated[N, Within(-90.0, 90.0)] = usual(0.0)
    """Turn of the camera against its mount: to its right,"""
    pitch_deg: Annotated[N, Within(-90.0, 90.0)] = usual(0.0)
    """... then up,"""
    roll_deg: Annotated[N, Within(-180.0, 180.0)] = usual(0.0)
    """... then clockwise, seen from behind."""
    width: Annotated[int, Strict(), Within(16, 4096)] = 346
    """Columns."""
    height: Annotated[int, Strict(), Within(16, 4096)] = 260
    """Rows."""
    fov_deg: Annotated[N, Within(5.0, 120.0)]
    """Horizontal field of view, of the undistorted image."""
    k1: Annotated[N, Within(-1.0, 1.0)] = usual(0.0)
    """Radial distortion, as OpenCV's: the term in r^2, negative for a barrel,"""
    k2: Annotated[N, Within(-1.0, 1.0)] = usual(0.0)
    """... and in r^4."""
    p1: Annotated[N, Within(-0.1, 0.1)] = usual(0.0)
    """Tangential distortion, as OpenCV's: mostly along the columns,"""
    p2: Annotated[N, Within(-0.1, 0.1)] = usual(0.0)
    """... and along the rows."""
    vignetting: Annotated[N, Within(0.0, 4.0)] = usual(0.0)
    """How much darker the image's edge is: light at an angle to the axis counts cos(angle)^(4 vignetting). 0 is not at
    all, 1 the natural law."""
    defocus_px: Annotated[N, Within(0.0, 20.0)] = usual(0.0)
    """Standard deviation of a Gaussian blur over all of the image, in pixels of an image of this width."""
    exposure: Literal["sample", "absolute"] = "sample"
    """Sample: the median luminance of the first held frame becomes 0.25 of white, as an aperture set once would.
    Absolute: white is white_cd_m2."""
    white_cd_m2: Annotated[N, Within(1e-6, 1e10)]
    """Luminance of white when the exposure is absolute."""


class SensorSpec(Section, Generic[N, S]):
    """The event pixels: a preset, and what differs from it."""

    preset: str = "davis346"
    """Name of an EventCamera preset."""
    theta: Annotated[N | None, Within(0.01, 5.0)] = None
    """Contrast threshold of both polarities, in ln units."""
    sigma: Annotated[N | None, Within(0.0, 1.0)] = None
    """Standard deviation of the threshold over the pixels, in ln units."""
    cutoff_hz: Annotated[N | None, Within(0.0, 1e6)] = None
    """Low-pass corner at white; 0 is none."""
    leak_rate_hz: Annotated[N | None, Within(0.0, 1e3)] = None
    """Leak events a second and pixel."""
    shot_rate_hz: Annotated[N | None, Within(0.0, 1e3)] = None
    """Shot-noise events a second and pixel in the dark."""
    refractory_us: Annotated[N | None, Within(0.0, 1e6)] = None
    """Dead time after an event."""


class RenderSpec(Section, Generic[N, S]):
    """How and when frames are drawn."""

    renderer: Literal["raycast", "pathtrace"] = "raycast"
    """Raycast: fast. Pathtrace: photorealistic and slow, needs the extra [photo]; its frames depend a little on whether
    the machine has LLVM or a GPU."""
    device: Literal["cpu"] = "cpu"
    """Where raycast shades its pixels; cpu is the only value, the key is kept for records that name it."""
    spp: Annotated[int, Strict(), Within(1, 65536)] = 64
    """Light paths a pixel of pathtrace: more of them, less noise."""
    key_motion_px: Annotated[float, Strict(), Within(0.0, 64.0)] = 4.0
    """Pathtrace: farthest that any point may move in the image between two frames that are traced. The frames between
    are made from both by the known motion. 0: all are traced."""

    max_motion_px: Annotated[float, Strict(), Within(0.01, 16.0)] = 0.5
    """Farthest that any point may move in the image between two frames."""
    min_rate_hz: Annotated[float, Strict(), Within(1.0, 10000.0)] = 60.0
    """Lowest frame rate, when nothing moves."""


class SampleSpec(Section, Generic[N, S]):
    """All of one sample."""

    object: ObjectSpec[N, S]
    grip: GripSpec[N, S]
    surface: SurfaceSpec[N, S]
    background: BackgroundSpec[N, S]
    light: LightSpec[N, S]
    robot: RobotSpec = RobotSpec()
    motion: MotionSpec[N, S]
    camera: CameraSpec[N, S]
    sensor: SensorSpec[N, S]
    render: RenderSpec[N, S]
    slip: SlipSpec[N, S] = Field(default={}, validate_default=True)


def keys(spec: SampleSpec) -> list[str]:
    """All keys of a sample as "section.name", in their order."""
    return [f"{section}.{name}" for section in SampleSpec.model_fields for name, _ in getattr(spec, section)]
