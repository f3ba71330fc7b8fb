"""Slip on purpose: for each kind, where the grip and the motion have to be, and how heavy the object."""

from dataclasses import dataclass
from typing import Any

from evslip.config.config import Config
from evslip.config.distributions import Uniform, choices, extremes
from evslip.config.params import Params
from evslip.config.sections.grip import GripSpec
from evslip.config.sections.slip import NATURAL
from evslip.draws import stratification
from evslip.physics.motion.phases import hanging_phases
from evslip.physics.onset import onset_mass
from evslip.scene.motions import KINDS as MOTIONS
from evslip.utils.errors import ConfigError
from evslip.utils.seeds import generator

Bounds = tuple[float, float]
PICK_AND_PLACE = ("pick_and_place",)


@dataclass(frozen=True)
class Recipe:
    """Recipe for one kind of slip."""

    multiple: Bounds
    """Mass as a multiple of the onset mass over `phases`."""
    phases: tuple[str, ...] = ()
    """Phases in which it shall slip; none: any in which it hangs."""
    earlier: tuple[str, ...] = ()
    """Phases in which it shall not slip before: there the mass is at most EARLIER of their onset mass."""
    motions: tuple[str, ...] = tuple(MOTIONS)
    """Kinds of motion that it works with."""


def _within(**ranges: float | Bounds | tuple[Bounds, Bounds]) -> dict[str, tuple[Bounds, ...]]:
    """Bounds by key, of the grip or the motion, from a number, a range, or one range for either side."""
    bounds: dict[str, Any] = {}
    for name, given in ranges.items():
        section = "grip" if name in GripSpec.model_fields else "motion"
        values: Any = given if isinstance(given, tuple) else (given, given)
        bounds[f"{section}.{name}"] = values if isinstance(values[0], tuple) else (values,)
    return bounds


EARLIER = 0.95
"""The first tenth of a degree comes at 0.97 of the onset mass."""
TILTED, HANGING = ("tilt", "back"), ("lift", "tilt", "back")
RECIPES: dict[str, Recipe] = {
    "hold": Recipe((0.3, 0.8)),
    "rotation": Recipe((1.1, 1.2)),
    "translation": Recipe((1.05, 1.08), ("lift",), motions=("pick_and_place", "hold")),
    "lift": Recipe((1.12, 1.3), ("lift",)),
    "tilt": Recipe((1.08, 1.25), TILTED, ("lift",), PICK_AND_PLACE),
    "placement": Recipe((1.12, 1.2), ("placement",), HANGING, PICK_AND_PLACE),
    "creep": Recipe((1.1, 1.2), TILTED, ("lift",), PICK_AND_PLACE),
    "drop": Recipe((0.985, 0.995), ("lift",), motions=PICK_AND_PLACE),
}
SETTINGS: dict[str, dict[str, tuple[Bounds, ...]]] = {
    "rotation": _within(offset=((-0.8, -0.5), (0.5, 0.8))),
    # A central grip without tilt carries no torque; the acceleration of a short lift overloads it for a moment.
    "translation": _within(offset=0.0, depth_m=(0.012, 0.016), tilt_deg=0.0, lift_m=0.06, lift_s=0.41),
    "lift": _within(offset=((-0.8, -0.4), (0.4, 0.8)), tilt_deg=0.0),
    "tilt": _within(offset=(-0.1, 0.1), tilt_deg=((-24.0, -18.0), (20.0, 30.0))),
    # The arm brakes as hard as it may, at the end of a long way down after a slow way up.
    "placement": _within(offset=((-0.8, -0.6), (0.6, 0.8)), depth_m=(0.008, 0.015), tilt_deg=0.0)
    | _within(lift_m=0.35, lift_s=2.4, lower_s=0.82),
    # The object swings in the hand at most at twice the speed at which the hand tilts.
    "creep": _within(offset=(-0.04, 0.04), depth_m=(-0.0045, 0.001), tilt_deg=((-14.5, -11.0), (11.0, 14.5)))
    | _within(lift_s=2.0, tilt_s=8.0),
    # Friction that nearly all goes into the weight has none left for a torque: while the tilt turns the object in the
    # hand, it slides out of it.
    "drop": _within(offset=0.0, depth_m=(-0.0045, 0.003), tilt_deg=((-25.0, -22.0), (25.0, 30.0)))
    | _within(lift_m=0.15, lift_s=3.5),
}
"""Ranges in which keys of the configuration have to lie, by kind of slip."""


def prepare(config: Config, index: int, split: str) -> Config:
    """The configuration from which sample `index` is drawn: of one kind of slip, with its recipe's values wherever the
    configuration's own go beyond them."""
    kind = _one(stratification.kinds(config, index, split), config, index, split, "draw slip.kind")
    if kind == NATURAL:
        return _with(config, {"slip.kind": kind, "slip.multiple": None})
    recipe = RECIPES[kind]
    changes: dict[str, Any] = {"slip.kind": kind}
    if config.slip.multiple is None:
        changes["slip.multiple"] = _distribution(recipe.multiple)
    motions = choices(config.motion.kind)
    fitting = tuple(name for name in motions if name in recipe.motions)
    if fitting and fitting != motions:
        changes["motion.kind"] = _one(fitting, config, index, split, "slip motion.kind")
    for key, intervals in SETTINGS.get(kind, {}).items():
        section, name = key.split(".")
        if not _inside(getattr(getattr(config, section), name), intervals):
            changes[key] = _distribution(_one(intervals, config, index, split, f"slip {key}"))
    return _with(config, changes)


def weigh(params: Params, by_default: bool) -> Params:
    """The parameters with the mass that their kind of slip wants. Raises ConfigError.

    `by_default`: slip.multiple is the recipe's own, which yields where the object would slip too early.
    """
    slip = params.slip
    if slip.kind == NATURAL or slip.multiple is None:
        return params
    recipe = RECIPES[slip.kind]
    if params.motion.kind not in recipe.motions:
        raise ConfigError(f"slip.kind: {slip.kind!r} needs motion.kind {' or '.join(recipe.motions)}")
    onset_kg = onset_mass(params, recipe.phases or None)
    mass_kg = slip.multiple * onset_kg
    earlier = [name for name in recipe.earlier if name in hanging_phases(params)]
    if by_default and earlier:
        mass_kg = min(mass_kg, EARLIER * onset_mass(params, earlier))
    heavy = stratification.with_mass(params, mass_kg, f"slip.kind: {slip.kind!r}")
    return heavy.model_copy(update={"slip": slip.model_copy(update={"multiple": mass_kg / onset_kg})})


def _one(choices: Any, config: Config, index: int, split: str, stage: str) -> Any:
    """One entry of a tuple; of a list of kinds both splits have all."""
    if not isinstance(choices, tuple):
        return choices
    return choices[int(generator(config.seed, split, index, stage).integers(len(choices)))]


def _inside(value: Any, intervals: tuple[Bounds, ...]) -> bool:
    return value is not None and all(
        any(low <= extremes(part)[0] and extremes(part)[1] <= high for low, high in intervals)
        for part in choices(value)
    )


def _distribution(bounds: Bounds) -> Uniform | float:
    low, high = bounds
    return low if low == high else Uniform(min=low, max=high)


def _with(config: Config, changes: dict[str, Any]) -> Config:
    sections: dict[str, dict[str, Any]] = {}
    for key, value in changes.items():
        section, name = key.split(".")
        sections.setdefault(section, {})[name] = value
    updated = {section: getattr(config, section).model_copy(update=values) for section, values in sections.items()}
    return config.model_copy(update=updated)
