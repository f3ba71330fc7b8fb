"""Kinds of motion: what the hand does with the object between the lift and the placement. One file a kind."""

from typing import Any, Protocol

import numpy as np

from evslip.scene.motions import hold, pick_and_place, rotate, shake, waypoints


class MotionKind(Protocol):
    """Every module of this package is one. `motion`: the section of that name of a sample's parameters."""

    @staticmethod
    def phases(motion: Any) -> dict[str, float]:
        """Names and lengths in seconds of the phases between lift and placement, in order."""
        ...

    @staticmethod
    def path(motion: Any, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Way of the tool centre from where the lift has put it (n, 3) in metres, and lateral tilt (n,) in radians, at
        times (n,) in seconds since the end of the lift. At rest before it, and upright and at rest after the last
        phase."""
        ...


KINDS: dict[str, MotionKind] = {
    "pick_and_place": pick_and_place,
    "hold": hold,
    "shake": shake,
    "rotate": rotate,
    "waypoints": waypoints,
}
