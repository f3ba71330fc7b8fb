"""The time line: approach, initial, lift, the phases of the kind of motion, placement, release."""

from evslip.config.params import Params
from evslip.physics.motion.pace import pace_of
from evslip.scene.motions import KINDS
from evslip.scene.motions.steps import lift_s, lower_s, scale

PHASE_NAMES = (
    *("approach", "initial", "lift"),
    *("tilt", "back", "hold", "shake", "rotate", "move"),
    *("placement", "release"),
)
"""Phases that a motion can have; records hold positions in this list, so it only ever grows at its end."""
APPROACH_S, INITIAL_S, PAUSE_S, RELEASE_S = 0.5, 0.45, 0.2, 0.8
"""Nominal lengths; the pause is the rest after lifting and after lowering."""
LEAST_INITIAL_S = 0.36
"""Time that fingers need to close and to come to rest, however short the whole is: of a grip that still closes when the
lift begins, a slip would not be seen."""


def phase_bounds_s(params: Params) -> dict[str, tuple[float, float]]:
    """Start and end of each phase in seconds."""
    bounds = planned_bounds_s(params)
    pace = pace_of(params, bounds)
    if pace is None:
        return bounds
    return {name: (pace.when(start), pace.when(end)) for name, (start, end) in bounds.items()}


def planned_bounds_s(params: Params) -> dict[str, tuple[float, float]]:
    """Start and end of each phase in seconds, at the usual pace."""
    motion = params.motion
    slower = scale(motion)
    lengths = {
        "approach": APPROACH_S * slower,
        "initial": max(INITIAL_S * slower, LEAST_INITIAL_S),
        "lift": lift_s(motion) + PAUSE_S * slower,
        **KINDS[motion.kind].phases(motion),
        "placement": lower_s(motion) + PAUSE_S * slower,
        "release": RELEASE_S * slower,
    }
    bounds, start = {}, 0.0
    for name, length in lengths.items():
        bounds[name] = start, start + length
        start += length
    return bounds


def phase_times(params: Params) -> dict[str, tuple[int, int]]:
    """Start and end of each phase in microseconds."""
    return {name: (round(start * 1e6), round(end * 1e6)) for name, (start, end) in phase_bounds_s(params).items()}


def hanging_phases(params: Params) -> tuple[str, ...]:
    """Names of the phases in which the grip carries the object, in order."""
    return tuple(name for name in phase_bounds_s(params) if name not in ("approach", "initial", "release"))
