"""The time line of the pick-and-place."""

from evslip.params import Params

NOMINAL_S = 7.5
"""Duration for which the times below are given; they scale with params.motion.duration_s."""
PHASES = {
    "approach": (0.0, 0.5),
    "initial": (0.5, 0.95),
    "lift": (0.95, 1.95),
    "tilt": (1.95, 3.75),
    "back": (3.75, 5.3),
    "placement": (5.3, 6.7),
    "release": (6.7, 7.5),
}
"""Start and end of each phase; the recorded ones are initial to placement."""


def phase_times(params: Params) -> dict[str, tuple[int, int]]:
    """Start and end of each phase in microseconds."""
    scale = params.motion.duration_s / NOMINAL_S * 1e6
    return {name: (round(start * scale), round(end * scale)) for name, (start, end) in PHASES.items()}
