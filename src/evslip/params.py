"""The concrete parameters of one sample, and how they are drawn."""

import math
from typing import Literal

from pydantic import ValidationError

from evslip.config import Config, explain
from evslip.errors import ConfigError, DataError, PlanRejected
from evslip.plan import make_plan
from evslip.schema import SampleSpec
from evslip.seeds import SPLITS, generator
from evslip.shapes.dimensions import settle
from evslip.values import Constant, Range


class Params(SampleSpec[Constant, str]):
    """One sample's parameters, every field a value. Everything else about the sample follows from them."""

    seed: int
    split: Literal["train", "test"]
    index: int

    @classmethod
    def from_json(cls, text: str | bytes) -> "Params":
        """Inverse of model_dump_json. Raises DataError."""
        try:
            return cls.model_validate_json(text)
        except ValidationError as error:
            raise DataError(f"stored parameters: {explain(error, cls)}") from None


def draw(config: Config, index: int, split: str = "train") -> Params:
    """The parameters of sample `index`; a pure function of (config, split, index).

    Each key has a generator of its own, so changing one key's distribution leaves all others' values alone. No value
    that a distribution yields in one split can occur in the other. Raises ConfigError.
    """
    from evslip import slip, stratification

    if split not in SPLITS:
        raise ConfigError(f"split: {split!r} is unknown; expected one of {', '.join(SPLITS)}")
    if index < 0:
        raise ConfigError(f"index: {index} is out of range, expected 0 or more")
    if split == "test" and config.test_share == 0:
        raise ConfigError("test_share: is 0, so the configuration has no test split")
    prepared = slip.prepare(config, index, split)
    plan = make_plan(prepared)
    rngs = {key: generator(config.seed, split, index, f"draw {key}") for key in plan.varied()}
    values, remaining = dict(plan.fixed), index
    for dimension, rows in reversed(list(zip(plan.dimensions, plan.shares[split], strict=True))):
        if config.sampling == "grid" and not dimension.is_pool:
            remaining, position = divmod(remaining, len(rows))
        else:
            position = int(rngs[dimension.keys[0]].integers(len(rows)))
        values.update(zip(dimension.keys, dimension.rows[rows[position]], strict=True))
    tree = prepared.model_dump(include=set(SampleSpec.model_fields))
    for key, value in values.items():
        section, name = key.split(".")
        if isinstance(value, Range):
            try:
                value = value.draw(rngs[key], odd=split == "test", without=plan.constants.get(key, frozenset()))
            except ConfigError as error:
                raise ConfigError(f"{key}: {error}") from None
        tree[section][name] = value
    params = Params.model_validate({**tree, "seed": config.seed, "split": split, "index": index})
    params = params.model_copy(update={"object": settle(params.object)})
    try:
        params = slip.weigh(params, by_default=config.slip.multiple is None)
        return stratification.weigh(config, params)
    except PlanRejected:  # pads that miss the object carry no mass; planning the motion says so
        return params


def grid_size(config: Config, split: str = "train") -> int:
    """Number of combinations of the configuration's lists in a split."""
    plan = make_plan(config)
    sizes = zip(plan.dimensions, plan.shares[split], strict=True)
    return math.prod(len(rows) for dimension, rows in sizes if not dimension.is_pool)
