"""The hand visits the way-points of the configuration, resting at each."""

from typing import Any

import numpy as np

from evslip.scene.motions.steps import scale, step

PAUSE_S = 0.2


def phases(motion: Any) -> dict[str, float]:
    return {"move": sum(point.time_s for point in _points(motion)) + PAUSE_S * scale(motion)}


def path(motion: Any, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    way, tilt, start = np.zeros((len(t_s), 3)), np.zeros(len(t_s)), 0.0
    place_m, tilt_deg = np.zeros(3), 0.0
    for point in _points(motion):
        share = step(t_s, start, point.time_s)
        way += share[:, None] * (point.place_m - place_m)
        tilt += share * np.radians(point.tilt_deg - tilt_deg)
        place_m, tilt_deg, start = point.place_m, point.tilt_deg, start + point.time_s
    return way, tilt


def _points(motion: Any) -> tuple[Any, ...]:
    return motion.waypoints.root if motion.waypoints else ()
