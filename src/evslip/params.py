"""The concrete parameters of one sample, and how they are drawn."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any, Literal

import numpy as np
from pydantic import ValidationError

from evslip import textures
from evslip.config import Config, explain
from evslip.errors import ConfigError, DataError
from evslip.schema import SampleSpec
from evslip.seeds import SPLITS, generator
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
    if split not in SPLITS:
        raise ConfigError(f"split: {split!r} is unknown; expected one of {', '.join(SPLITS)}")
    if index < 0:
        raise ConfigError(f"index: {index} is out of range, expected 0 or more")
    if split == "test" and config.test_share == 0:
        raise ConfigError("test_share: is 0, so the configuration has no test split")
    tree = config.model_dump(exclude={"sampling", "test_share", "seed"})
    remaining = index
    for section, name, value in reversed(list(_leaves(config))):
        rng = generator(config.seed, split, index, f"draw {section}.{name}")
        if isinstance(value, tuple):
            choices = _share(config, f"{section}.{name}", value, split)
            if config.sampling == "grid" and value is getattr(getattr(config, section), name):
                remaining, position = divmod(remaining, len(choices))
            else:
                position = int(rng.integers(len(choices)))
            value = choices[position]
        if name == "texture":
            _of_section(section, textures.check, value)
        tree[section][name] = value.draw(rng, odd=split == "test") if isinstance(value, Range) else value
    return Params.model_validate({**tree, "seed": config.seed, "split": split, "index": index})


def grid_size(config: Config, split: str = "train") -> int:
    """Number of combinations of the configuration's lists in a split."""
    lists = ((s, n, getattr(getattr(config, s), n)) for s, n, _ in _leaves(config))
    sizes = [len(_share(config, f"{s}.{n}", value, split)) for s, n, value in lists if isinstance(value, tuple)]
    return int(np.prod(sizes, dtype=np.int64))


def _leaves(config: Config) -> Iterator[tuple[str, str, Any]]:
    """(section, name, value) of every field, texture patterns replaced by the names they match.

    A list that came from a pattern is a pool to draw from, never a dimension of a grid.
    """
    for section in SampleSpec.model_fields:
        for name, value in getattr(config, section):
            yield section, name, _of_section(section, textures.expand, value) if name == "texture" else value


def _of_section(section: str, function: Callable[[Any], Any], value: Any) -> Any:
    """Call a function of textures, whose errors begin with the key's last part."""
    try:
        return function(value)
    except ConfigError as error:
        raise ConfigError(f"{section}.{error}") from None


def _share(config: Config, key: str, choices: Sequence[Any], split: str) -> Sequence[Any]:
    """The part of a list that belongs to a split: ranges to both (their lattices differ), constants to one.

    A texture kept for testing is kept from every texture list, so that no part of a training scene shows it.
    """
    constants = {choice for choice in choices if not isinstance(choice, Range)}
    if config.test_share == 0 or not constants:
        return choices
    is_names = isinstance(choices[0], str)
    pool = sorted(_texture_pool(config) if is_names else constants)
    order = generator(config.seed, "train", 0, f"split {'texture' if is_names else key}").permutation(len(pool))
    held_out = {pool[i] for i in order[: max(1, round(config.test_share * len(pool)))]}
    mine = [c for c in choices if isinstance(c, Range) or (c in held_out) == (split == "test")]
    if not mine:
        raise ConfigError(f"{key}: too few values to split between train and test; give more or set test_share = 0")
    return mine


def _texture_pool(config: Config) -> set[str]:
    return {
        name for _, field, value in _leaves(config) if field == "texture" and isinstance(value, tuple) for name in value
    }
