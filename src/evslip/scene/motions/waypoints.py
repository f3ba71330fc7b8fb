"""The hand visits the way-points of the configuration, resting at each."""

import numpy as np

from evslip.config.schema import MotionSpec, Waypoint
from evslip.scene.motions.steps import scale, step

PAUSE_S = 0.2


def phases(motion: MotionSpec[float, str]) -> dict[str, float]:
    return {"move": sum(point.time_s for point in _points(motion)) + PAUSE_S * scale(motion)}


def path(motion: MotionSpec[float, str], t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    way, tilt, start = np.zeros((len(t_s), 3)), np.zeros(len(t_s)), 0.0
    before = Waypoint()
    for point in _points(motion):
        share = step(t_s, start, point.time_s)
        way += share[:, None] * (point.place_m - before.place_m)
        tilt += share * np.radians(point.tilt_deg - before.tilt_deg)
        before, start = point, start + point.time_s
    return way, tilt


def _points(motion: MotionSpec[float, str]) -> tuple[Waypoint, ...]:
    return motion.waypoints.root if motion.waypoints else ()
