"""Whether samples do what the names of their kinds of slip say."""

from evslip.config.sections.slip import NATURAL, NO_SLIP
from evslip.draws.provoked_slips import RECIPES
from evslip.physics.truth import Truth

CREEP_DEG_S = 1.0 / 0.16
"""Faster would be slip in a window by the paper's rule."""


def shows(kind: str, truth: Truth) -> bool:
    """Whether a sample does what the name of a kind says."""
    slips = truth.episodes
    if kind in (NATURAL, NO_SLIP):
        return kind == NATURAL or not slips
    if not slips:
        return False
    if kind in ("rotation", "translation"):
        return all(slip.kind == kind for slip in slips)
    if kind == "drop":
        return slips[-1].kind == "drop"
    if kind == "creep":
        slow = truth.angular_speed_deg_s[truth.held & truth.during("tilt", "back")] < CREEP_DEG_S
        return slips[-1].kind != "drop" and bool(slow.all())
    return slips[0].phase in RECIPES[kind].phases
