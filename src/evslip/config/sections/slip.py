"""Slip on purpose: which kind, and how much heavier than what the grip carries the object is."""

from typing import Annotated, Generic

from evslip.config.section import N, OneOf, S, Section, Within, usual, wrong

NATURAL, NO_SLIP = "natural", "hold"
SLIP_KINDS = (NATURAL, NO_SLIP, "rotation", "translation", "lift", "tilt", "placement", "creep", "drop")
"""`draws.provoked_slips.RECIPES` says how each is brought about."""


class SlipSpec(Section, Generic[N, S]):
    """Slip on purpose."""

    kind: Annotated[S, OneOf(SLIP_KINDS)] = usual("natural")
    """Natural: as object.mass_kg has it. Hold: none. Rotation, translation: of this form. Lift, tilt, placement: in
    this phase. Creep: slowly. Drop: out of the hand. All but natural choose the mass and, where they must, grip and
    motion. Of a list every sample has one, at random."""
    multiple: Annotated[N | None, Within(0.01, 20.0)] = None
    """Mass as a multiple of the onset mass, over the phases of the kind. Default: the kind's own."""

    def _check(self) -> None:
        if self.kind == NATURAL and self.multiple is not None:
            raise wrong("multiple", "needs a slip.kind other than natural")
