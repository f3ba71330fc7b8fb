"""The camera: where it sits, what its lens and its pixels are; or two of them."""

from typing import Annotated, Any, Generic

from pydantic import Strict, model_serializer

from evslip.config.section import LATER, N, OneOf, S, Section, Within, check_limits, usual, wrong
from evslip.scene.mounts import MOUNTS

EXPOSURES = ("sample", "absolute")
CAMERAS = ("left", "right")
"""Names of two cameras."""


class ViewSpec(Section, Generic[N, S]):
    """Differences of one of two cameras from the section camera; its keys and limits are that section's."""

    mount: S | None = None
    x_m: N | None = None
    y_m: N | None = None
    z_m: N | None = None
    yaw_deg: N | None = None
    pitch_deg: N | None = None
    roll_deg: N | None = None
    width: Annotated[int, Strict()] | None = None
    height: Annotated[int, Strict()] | None = None
    fov_deg: N | None = None
    k1: N | None = None
    k2: N | None = None
    p1: N | None = None
    p2: N | None = None
    vignetting: N | None = None
    defocus_px: N | None = None
    exposure: S | None = None
    white_cd_m2: N | None = None

    def _check(self) -> None:
        check_limits(self, CameraSpec.model_fields)

    @model_serializer
    def _given(self) -> dict[str, Any]:
        return {name: value for name, value in self if value is not None}


class CameraSpec(Section, Generic[N, S]):
    """The event camera, fixed to the hand."""

    mount: Annotated[S, OneOf(tuple(MOUNTS))] = usual("side")
    """Side: looks along the closing axis, a rotating slip lies in the image plane. Front: across it. Custom: at x_m,
    y_m, z_m, looks at the tool centre. Robot: where the robot's file puts it, looks at the tool centre. Finger,
    finger-right: in the left or right finger, which is clear, looks through it at the contact."""
    x_m: Annotated[N, Within(-0.5, 0.5)] = usual(0.0)
    """Position in the hand's frame, in the image plane of side. It is added to the mount's, which is (0, 0.27, 0.13)
    for side, (0.27, 0, 0.13) for front, 0 for custom, that of the robot's file for robot, and 0.05 behind the pad's
    face for finger."""
    y_m: Annotated[N, Within(-0.5, 0.5)] = usual(0.0)
    """Position along the closing axis, likewise."""
    z_m: Annotated[N, Within(-0.5, 0.5)] = usual(0.0)
    """Position along the way that the fingers point, likewise; the tool centre is at 0.1034. A small range of each is a
    jitter."""
    yaw_deg: Annotated[N, Within(-90.0, 90.0)] = usual(0.0)
    """Turn of the camera against its mount, to its right."""
    pitch_deg: Annotated[N, Within(-90.0, 90.0)] = usual(0.0)
    """Turn upwards, after yaw_deg."""
    roll_deg: Annotated[N, Within(-180.0, 180.0)] = usual(0.0)
    """Turn clockwise, seen from behind, after pitch_deg."""
    width: Annotated[int, Strict(), Within(16, 4096)] = 346
    """Columns."""
    height: Annotated[int, Strict(), Within(16, 4096)] = 260
    """Rows."""
    fov_deg: Annotated[N, Within(5.0, 120.0)]
    """Horizontal field of view, of the undistorted image."""
    k1: Annotated[N, Within(-1.0, 1.0)] = usual(0.0)
    """Radial distortion, as OpenCV's: the term in r^2, negative for a barrel."""
    k2: Annotated[N, Within(-1.0, 1.0)] = usual(0.0)
    """Radial distortion: the term in r^4."""
    p1: Annotated[N, Within(-0.1, 0.1)] = usual(0.0)
    """Tangential distortion, as OpenCV's: mostly along the columns."""
    p2: Annotated[N, Within(-0.1, 0.1)] = usual(0.0)
    """Tangential distortion: mostly along the rows."""
    vignetting: Annotated[N, Within(0.0, 4.0)] = usual(0.0)
    """How much darker the image's edge is: light at an angle to the axis counts cos(angle)^(4 vignetting). 0 is not at
    all, 1 the natural law."""
    defocus_px: Annotated[N, Within(0.0, 20.0)] = usual(0.0)
    """Standard deviation of a Gaussian blur over all of the image, in pixels of an image of this width."""
    exposure: Annotated[S, OneOf(EXPOSURES)] = usual("sample")
    """Sample: the median luminance of the first held frame becomes 0.25 of white, as an aperture set once would.
    Absolute: white is white_cd_m2."""
    white_cd_m2: Annotated[N, Within(1e-6, 1e10)]
    """Luminance of white when the exposure is absolute."""
    left: Annotated[ViewSpec[N, S] | None, LATER] = None
    """Two cameras at once: a table of the keys above that are different for the left one. A record then holds a stream
    of each camera."""
    right: Annotated[ViewSpec[N, S] | None, LATER] = None
    """The same of the right camera."""

    def _check(self) -> None:
        for one, other in (CAMERAS, CAMERAS[::-1]):
            if getattr(self, one) is None and getattr(self, other) is not None:
                raise wrong(one, f"is missing beside {other}; expected both, if only an empty [camera.{one}], or none")
