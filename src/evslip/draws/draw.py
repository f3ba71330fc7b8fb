"""Draws of the parameters of a sample from a configuration."""

import functools
import math

from evslip.config.config import Config
from evslip.config.distributions import Uniform
from evslip.config.params import Params
from evslip.config.sample import SampleSpec
from evslip.draws import grid, provoked_slips, stratification
from evslip.draws.draw_plan import make_plan
from evslip.physics.onset import onset_mass
from evslip.physics.robots.catalogue import pinned
from evslip.scene.shapes.dimensions import resolve_object
from evslip.utils.errors import ConfigError, PlanRejected
from evslip.utils.seeds import SPLITS, generator


def draw(config: Config, index: int, split: str = "train") -> Params:
    """The parameters of sample `index`; a pure function of (config, split, index).

    Each key has a generator of its own, so changing one key's distribution leaves all others' values alone. No value
    that a distribution yields in one split can occur in the other. Raises ConfigError.
    """
    if not isinstance(config, Config):
        raise ConfigError(
            f"config: {type(config).__name__}, expected a Config; load_config makes one of a preset's name"
        )
    if split not in SPLITS:
        raise ConfigError(f"split: {split!r} is unknown; expected one of {', '.join(SPLITS)}")
    if index < 0:
        raise ConfigError(f"index: {index} is out of range, expected 0 or more")
    if split == "test" and config.test_share == 0:
        raise ConfigError("test_share: is 0, so the configuration has no test split")
    prepared = provoked_slips.prepare(config, index, split)
    plan = make_plan(prepared)
    rngs = {key: generator(config.seed, split, index, f"draw {key}") for key in plan.varied()}
    values, places = dict(plan.fixed), iter(grid.places(index, plan.grid_sizes(split)))
    for dimension, rows in zip(plan.dimensions, plan.shares[split], strict=True):
        if config.sampling == "grid" and not dimension.is_pool:
            position = next(places)
        else:
            position = int(rngs[dimension.keys[0]].integers(len(rows)))
        values.update(zip(dimension.keys, dimension.rows[rows[position]], strict=True))
    tree = prepared.model_dump(include=set(SampleSpec.model_fields))
    for key, value in values.items():
        *home, name = key.split(".")
        if isinstance(value, Uniform):
            try:
                value = value.draw(rngs[key], odd=split == "test", without=plan.constants.get(key, frozenset()))
            except ConfigError as error:
                raise ConfigError(f"{key}: {error}") from None
        functools.reduce(dict.__getitem__, home, tree)[name] = value
    for section, share in config.share:
        if share < 1 and generator(config.seed, split, index, f"share {section}").random() >= share:
            tree[section] = {}
    if tree["motion"]["kind"] != "waypoints":
        tree["motion"]["waypoints"] = None  # of other kinds in the same list
    params = Params.model_validate({**tree, "seed": config.seed, "split": split, "index": index})
    params = params.model_copy(update={"object": resolve_object(params.object), "robot": pinned(params.robot)})
    try:
        params = provoked_slips.weigh(params, by_default=config.slip.multiple is None)
        return stratification.weigh(config, params)
    except PlanRejected:  # pads that miss the object carry no mass; planning the motion says so
        return params


def grid_size(config: Config, split: str = "train") -> int:
    """Number of combinations of the configuration's lists in a split."""
    return math.prod(make_plan(config).grid_sizes(split))


def sure_masses(config: Config, count: int) -> tuple[float, float, float, float]:
    """Over the first `count` training samples: least and largest onset mass, and from these the ends of a range of
    masses: the mass that holds in every sample, and the one that slips in every sample; all in kilograms."""
    onsets = [onset_mass(draw(config, index)) for index in range(count)]
    return min(onsets), max(onsets), stratification.SURE_HOLD * min(onsets), stratification.SURE_SLIP * max(onsets)
