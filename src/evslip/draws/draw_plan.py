"""Plan of a configuration's draws, worked out once for all of them."""

from functools import lru_cache
from typing import Any, NamedTuple

from evslip.config.config import Config
from evslip.config.distributions import Uniform
from evslip.config.sample import leaves
from evslip.draws.splits import TEXTURE, Dimension, divide
from evslip.scene.textures import library
from evslip.utils.errors import ConfigError


class DrawPlan(NamedTuple):
    """Patterns replaced by the names they match, choices divided between the splits."""

    fixed: dict[str, Any]
    """Every key that is no choice, with its constant or range."""
    dimensions: tuple[Dimension, ...]
    """The choices, in the order of their first keys."""
    shares: dict[str, tuple[tuple[int, ...], ...]]
    """The rows of each dimension that a split, "train" or "test", draws from."""
    constants: dict[str, frozenset[Any]]
    """Constants among the entries of every key that is a choice: no range next to them may yield one of them."""

    def varied(self) -> list[str]:
        """Keys that are not the same in every sample."""
        return [k for k, value in self.fixed.items() if isinstance(value, Uniform)] + list(self.constants)

    def grid_sizes(self, split: str) -> tuple[int, ...]:
        """Lengths of a split's lists that a grid combines."""
        rows = zip(self.dimensions, self.shares[split], strict=True)
        return tuple(len(share) for dimension, share in rows if not dimension.is_pool)


def make_plan(config: Config) -> DrawPlan:
    """The plan of a configuration. Folders of images are listed here, once. Raises ConfigError."""
    hashable: Any = config  # as a frozen model is, which type checkers do not know
    return _make_plan(hashable)


@lru_cache(maxsize=64)  # one for each kind of slip and its variants
def _make_plan(config: Config) -> DrawPlan:
    given = leaves(config)
    values = {key: _textures(key, value) if key.endswith(f".{TEXTURE}") else value for key, value in given.items()}
    groups = [
        tuple(key for key in group if isinstance(given[key], tuple) and given[key] == values[key])
        for group in config.together
    ]
    group_of = {key: group for group in groups for key in group}
    dimensions: dict[tuple[str, ...], Dimension] = {}
    for key, value in values.items():
        if isinstance(value, tuple):
            keys = group_of.get(key, (key,))
            rows = tuple(zip(*(values[k] for k in keys), strict=True))
            dimensions[keys] = Dimension(keys, rows, is_pool=value != given[key])
    choices = tuple(dimensions.values())
    entries = {key: column for d in choices for key, column in zip(d.keys, zip(*d.rows, strict=True), strict=True)}
    return DrawPlan(
        fixed={key: value for key, value in values.items() if key not in entries},
        dimensions=choices,
        shares=divide(choices, config.seed, config.test_share),
        constants={key: frozenset(e for e in column if not isinstance(e, Uniform)) for key, column in entries.items()},
    )


def _textures(key: str, value: Any) -> Any:
    """The names that a texture's patterns and folders stand for."""
    try:
        return library.expand(value, is_background=key.startswith("background."))
    except ConfigError as error:
        raise ConfigError(f"{key.removesuffix(TEXTURE)}{error}") from None
