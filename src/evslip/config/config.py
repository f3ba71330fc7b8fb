"""The configuration of a data set: what its samples are drawn from, and how they are drawn."""

from typing import Annotated, Literal

from pydantic import Field, Strict

from evslip.config.distributions import Names, Number, choices
from evslip.config.nuisances.share import ShareSpec
from evslip.config.sample import SampleSpec, leaves
from evslip.config.section import LATER, Within, wrong
from evslip.config.sections.slip import NATURAL, NO_SLIP


class Config(SampleSpec[Number, Names]):
    """Configuration of a data set: every field a constant or a distribution."""

    seed: Annotated[int, Strict(), Within(0, 2**63 - 1)] = 0
    """Everything derives from (seed, split, index). 0 is a seed like any other."""
    sampling: Literal["grid", "random"] = "random"
    """Grid: lists are combined exhaustively, in a mixed order. Random: drawn. Ranges are drawn in both."""
    test_share: Annotated[float, Strict(), Within(0.0, 0.9)] = 0.2
    """Share of every list's constants that is kept for the test split; 0: the data set has no test split."""
    together: tuple[tuple[str, ...], ...] = ()
    """Groups of keys whose lists are walked through together, entry by entry, instead of being combined."""
    share: Annotated[ShareSpec, LATER] = ShareSpec()
    """Shares of the samples that have each nuisance."""
    files_sha256: Annotated[str | None, Field(pattern="^[0-9a-f]{64}$"), LATER] = None
    """Digest of all files that textures, object.mesh and sensor.preset name, of a folder's images too: with others, or
    under other names, nothing is made. Noted by itself where a data set is begun."""
    slip_fraction: Annotated[float | None, Strict(), Within(0.0, 1.0)] = None
    """If given, this share of the samples slips: each gets a mass above 1.25 or below 0.85 of its onset mass."""

    def _check(self) -> None:
        super()._check()
        self._check_groups()
        if self.slip_fraction is not None:
            self._check_fraction(self.slip_fraction)

    def _check_groups(self) -> None:
        given, seen = leaves(self), set()
        for group in self.together:
            lengths = {}
            for key in group:
                if key not in given:
                    raise wrong("together", f"{key!r} is unknown, expected keys such as object.texture")
                if key in seen:
                    raise wrong("together", f"{key} occurs twice")
                seen.add(key)
                if isinstance(given[key], tuple):
                    lengths[key] = len(given[key])
            if len(set(lengths.values())) > 1:
                counts = ", ".join(f"{key} has {length} entries" for key, length in lengths.items())
                raise wrong("together", f"{counts}, expected lists of equal length")

    def _check_fraction(self, share: float) -> None:
        kinds = choices(self.slip.kind)
        holds = NO_SLIP in kinds or share == 1
        slips = any(kind != NO_SLIP for kind in kinds) or share == 0
        if NATURAL not in kinds and not (holds and slips):
            raise wrong("slip_fraction", "needs a slip.kind that is natural, or a list of hold and another kind")
        if self.object.density_kg_m3 is not None:
            raise wrong("slip_fraction", "chooses object.mass_kg, so object.density_kg_m3 cannot be given")
