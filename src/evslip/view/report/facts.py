"""Facts on a sample, and doubts about its label."""

from typing import Any

from evslip.data.record import Record
from evslip.physics.onset import onset_mass

SLIP_DEG, SLIP_MM = 1.0, 2.0
"""An object that turns or slides by so much while it is held has moved."""


def facts_of(sample: Record) -> dict[str, Any]:
    """Facts on a simulated sample: mass and onset mass in kg, motion and shape, the onset in seconds, and how far the
    object turned (degrees) and slid (mm) while it was held."""
    params, truth = sample.params, sample.truth
    assert params is not None and truth is not None  # a simulated record has both
    held = truth.held
    return {
        "mass_kg": params.object.mass_kg,
        "onset_mass_kg": float(onset_mass(params)),
        "motion": params.motion.kind,
        "shape": params.object.shape,
        "texture": str(params.object.texture),
        "onset_s": None if truth.onset_us is None else truth.onset_us / 1e6,
        "turned_deg": _change(truth.theta_deg[held]),
        "slid_mm": _change(truth.slide_mm[held]),
    }


def doubt_of(label: str, facts: dict[str, Any]) -> str:
    """Contradiction between a sample's label and how its object moved; empty where there is none."""
    moved = facts["turned_deg"] >= SLIP_DEG or facts["slid_mm"] >= SLIP_MM
    if moved and label == "hold":
        return "moved, but is called hold"
    return "hardly moved, but is called slip" if not moved and label == "slip" else ""


def _change(values: Any) -> float:
    """The largest distance of a value from the first one."""
    return float(abs(values - values[0]).max()) if len(values) else 0.0
