"""A wanted share of samples that slip, each by its own onset mass."""

from evslip.config.config import Config
from evslip.config.distributions import extremes
from evslip.config.params import Params
from evslip.config.section import Within
from evslip.config.sections.object import ObjectSpec
from evslip.config.sections.slip import NATURAL, NO_SLIP
from evslip.physics.onset import onset_mass
from evslip.utils.errors import ConfigError
from evslip.utils.seeds import generator

BLOCK = 20
"""Samples among which the share is met, in an order of their own."""
SURE_HOLD, SURE_SLIP = 0.85, 1.25
"""Multiples of the onset mass below which every grasp held and above which every one slipped."""


def shall_slip(config: Config, index: int, split: str) -> bool | None:
    """Whether sample `index` is one of those that slip; None where slip_fraction is not set.

    Of the first n samples, round(n x slip_fraction) slip for every n that is a multiple of BLOCK. Where in a block they
    are is random, so that it goes with no other parameter of a grid.
    """
    if config.slip_fraction is None:
        return None
    block, place = divmod(index, BLOCK)
    before, after = (int(BLOCK * number * config.slip_fraction + 0.5) for number in (block, block + 1))
    order = generator(config.seed, split, block, "slip_fraction").permutation(BLOCK)
    return bool(order[place] < after - before)


def kinds(config: Config, index: int, split: str) -> str | tuple[str, ...]:
    """The kinds of slip that sample `index` may be of."""
    slips, given = shall_slip(config, index, split), config.slip.kind
    if slips is None or isinstance(given, str):
        return given
    fitting = tuple(kind for kind in given if kind == NATURAL or (kind != NO_SLIP) == slips)
    return fitting[0] if len(fitting) == 1 else fitting


def weigh(config: Config, params: Params) -> Params:
    """Parameters of a natural sample with a mass that surely slips or surely holds, as slip_fraction wants it.

    The range that the configuration gives is cut at its guaranteed end, 1.25 or 0.85 of the sample's own onset mass,
    and the mass keeps its relative place in it. It always reaches 30 % beyond the guaranteed slip, or down to half of
    the guaranteed hold, also where the configuration's does not.
    """
    slips = shall_slip(config, params.index, params.split)
    if slips is None or params.slip.kind != NATURAL:
        return params
    onset_kg = onset_mass(params)
    low, high = extremes(config.object.mass_kg)
    share = (params.object.mass_kg - low) / (high - low) if low < high else 0.5
    if slips:
        low, high = max(low, SURE_SLIP * onset_kg), max(high, 1.3 * SURE_SLIP * onset_kg)
    else:
        low, high = min(low, 0.5 * SURE_HOLD * onset_kg), min(high, SURE_HOLD * onset_kg)
    return with_mass(params, low + share * (high - low), f"slip_fraction: {config.slip_fraction:g}")


def with_mass(params: Params, mass_kg: float, wish: str) -> Params:
    """The parameters with another mass. Raises ConfigError, which begins with `wish`, where it is beyond the limits."""
    limits = next(m for m in ObjectSpec.model_fields["mass_kg"].metadata if isinstance(m, Within))
    if not limits.low <= mass_kg <= limits.high:
        raise ConfigError(
            f"{wish} needs a mass of {mass_kg:.3g} kg, beyond {limits.low:g} to {limits.high:g}; "
            "change grip.force_n or grip.friction"
        )
    return params.model_copy(update={"object": params.object.model_copy(update={"mass_kg": mass_kg})})
