"""Which choices are for training and which for testing, so that no value occurs in both."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple, TypeVar

from evslip.errors import ConfigError
from evslip.seeds import generator
from evslip.values import Atom, Range

Token = tuple[str, float | str]
"""A constant and the domain in which it must not be shared: its key, or TEXTURE for all textures of a scene."""
TEXTURE = "texture"
T = TypeVar("T")


class Dimension(NamedTuple):
    """Keys that are varied as one: a key with a list, or several whose lists are walked through together."""

    keys: tuple[str, ...]
    rows: tuple[tuple[Atom | str, ...], ...]
    """What the keys can become, one entry for each key."""
    is_pool: bool
    """The rows came from a pattern: a pool to draw from, never a dimension of a grid."""

    def tokens(self, row: int) -> set[Token]:
        """Constants of a row. A range is no token: both splits draw from it, on lattices that never meet."""
        pairs = zip(self.keys, self.rows[row], strict=True)
        return {(domain(key), atom) for key, atom in pairs if not isinstance(atom, Range)}


def domain(key: str) -> str:
    """A texture kept for testing is kept from every texture list, so that no part of a training scene shows it."""
    return TEXTURE if key.endswith(f".{TEXTURE}") else key


def divide(dimensions: Sequence[Dimension], seed: int, test_share: float) -> dict[str, tuple[tuple[int, ...], ...]]:
    """Of each dimension the rows that each split draws from; with test_share = 0 all are for training.

    Rows that have a constant in common, in whatever dimension, go to the same side. Of each set of domains that rows
    link, at least one and about `test_share` of the linked groups are held out. Raises ConfigError where a split would
    be left without a choice.
    """
    everything = tuple(tuple(range(len(dimension.rows))) for dimension in dimensions)
    if test_share == 0:
        return {"train": everything, "test": tuple(() for _ in dimensions)}
    held_out = set(_held_out(dimensions, seed, test_share))
    train, test = [], []
    for dimension, rows in zip(dimensions, everything, strict=True):
        tokens = [dimension.tokens(row) for row in rows]
        train.append(tuple(row for row in rows if not tokens[row] & held_out))
        test.append(tuple(row for row in rows if not tokens[row] or tokens[row] & held_out))
        if not train[-1] or not test[-1]:
            raise ConfigError(
                f"{', '.join(dimension.keys)}: too few values to split between train and test; "
                "give more or set test_share = 0"
            )
    return {"train": tuple(train), "test": tuple(test)}


def _held_out(dimensions: Sequence[Dimension], seed: int, test_share: float) -> Iterator[Token]:
    rows = [tokens for d in dimensions for row in range(len(d.rows)) if (tokens := d.tokens(row))]
    groups = sorted(sorted(group) for group in _linked(rows))
    for domains in _linked([{name for name, _ in group} for group in groups]):
        mine = [group for group in groups if group[0][0] in domains]
        order = generator(seed, "train", 0, f"split {' '.join(sorted(domains))}").permutation(len(mine))
        for position in order[: max(1, round(test_share * len(mine)))]:
            yield from mine[position]


def _linked(sets: Sequence[set[T]]) -> list[set[T]]:
    """Union of all sets that have elements in common, directly or through others."""
    home: dict[T, set[T]] = {}
    for members in sets:
        union = set(members).union(*(home[member] for member in members if member in home))
        home.update(dict.fromkeys(union, union))
    return list({id(union): union for union in home.values()}.values())
