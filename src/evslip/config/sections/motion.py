"""The motion of the hand between grasp and release."""

from typing import Annotated, Generic, Literal

import numpy as np
from pydantic import ConfigDict, RootModel, Strict, model_validator

from evslip.config.distributions import choices
from evslip.config.section import N, OneOf, S, Section, Within, usual, wrong
from evslip.scene.motions import KINDS


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


class MotionSpec(Section, Generic[N, S]):
    """Motion of the hand: approach, grasp, lift, the motion of its kind, place, release."""

    kind: Annotated[S, OneOf(tuple(KINDS))] = usual("pick_and_place")
    """Between lift and placement: tilt while moving to the goal and back upright, hold still, shake along an axis, turn
    to either side, or visit way-points."""
    duration_s: Annotated[N, Within(3.0, 60.0)]
    """Whole length of the pick-and-place. All times scale with it, except those given below, which lengthen or shorten
    the whole, and the time to close the fingers, which is never less than 0.36 s."""
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
    """Way-points of the kind waypoints: a list such as [{ y_m = -0.1, z_m = 0.05, tilt_deg = 20.0, time_s = 1.5 },
    { y_m = -0.2 }], counted from where the lift ends; the object is set down below the last."""

    def _check(self) -> None:
        is_given = bool(self.waypoints and self.waypoints.root)
        if is_given and "waypoints" not in choices(self.kind):
            raise wrong("waypoints", "needs motion.kind = 'waypoints'")
        if not is_given and "waypoints" in choices(self.kind):
            raise wrong("waypoints", "is missing, motion.kind 'waypoints' needs it")
