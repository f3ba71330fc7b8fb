"""Splits: which choices are for training and which for testing, so that no value occurs in both."""

from collections.abc import Sequence
from typing import NamedTuple, TypeVar

from evslip.config.distributions import Atom, Uniform
from evslip.utils.errors import ConfigError
from evslip.utils.seeds import generator

Token = tuple[str, float | str]
"""A constant and the domain in which it must not be shared: its key, or TEXTURE for all textures of a scene."""
TEXTURE = "texture"
FILES = (TEXTURE, "mesh")
"""Names that the splits do not share. Other names, such as shapes, are of few kinds, and both splits have all."""
T = TypeVar("T")


class Dimension(NamedTuple):
    """Keys that are varied as one: a key with a list, or several whose lists are walked through together."""

    keys: tuple[str, ...]
    rows: tuple[tuple[Atom | str, ...], ...]
    """Values that the keys can take together, one entry for each key."""
    is_pool: bool
    """The rows came from a pattern: a pool to draw from, never a dimension of a grid."""

    def tokens(self) -> list[set[Token]]:
        """Constants of each row that one split alone may have. No ranges: of these both draw, but never the same."""
        rows = [zip(self.keys, row, strict=True) for row in self.rows]
        return [{(domain(k), a) for k, a in row if not isinstance(a, Uniform) and is_divided(k, a)} for row in rows]


def is_divided(key: str, value: object) -> bool:
    """Whether this value of a key that varies must not occur in both splits."""
    return not isinstance(value, str) or key.rpartition(".")[2] in FILES


def domain(key: str) -> str:
    """A texture kept for testing is kept from every texture list, so that no part of a training scene shows it."""
    return TEXTURE if key.endswith(f".{TEXTURE}") else key


def divide(dimensions: Sequence[Dimension], seed: int, test_share: float) -> dict[str, tuple[tuple[int, ...], ...]]:
    """Rows of each dimension that each split draws from; with test_share = 0 all are for training.

    Rows that have a constant in common, in whatever dimension, go to the same side. Of each set of domains that rows
    link, at least one and about `test_share` of the linked groups are held out. Raises ConfigError where a split would
    be left without a choice.
    """
    if test_share == 0:
        return {"train": tuple(tuple(range(len(d.rows))) for d in dimensions), "test": tuple(() for _ in dimensions)}
    constants = [dimension.tokens() for dimension in dimensions]
    held_out = _held_out(constants, seed, test_share)
    train, test = [], []
    for dimension, rows in zip(dimensions, constants, strict=True):
        train.append(tuple(row for row, tokens in enumerate(rows) if not tokens & held_out))
        test.append(tuple(row for row, tokens in enumerate(rows) if not tokens or tokens & held_out))
        if not train[-1] or not test[-1]:
            raise ConfigError(
                f"{', '.join(dimension.keys)}: too few values to split between train and test; "
                "give more or set test_share = 0"
            )
    return {"train": tuple(train), "test": tuple(test)}


def _held_out(constants: Sequence[Sequence[set[Token]]], seed: int, test_share: float) -> set[Token]:
    groups = sorted(sorted(group) for group in _linked([tokens for rows in constants for tokens in rows if tokens]))
    ranked: list[int] = []
    held: set[int] = set()
    for domains in sorted(sorted(names) for names in _linked([{name for name, _ in group} for group in groups])):
        mine = [i for i, group in enumerate(groups) if group[0][0] in domains]
        order = generator(seed, "train", 0, f"split {' '.join(domains)}").permutation(len(mine))
        shuffled = sorted((mine[i] for i in order), key=lambda i: _family(groups[i][0][1]))
        number = max(1, round(test_share * len(mine)))
        # Evenly along the families, so that both splits have about the same mixture.
        held.update(shuffled[int((k + 0.5) * len(mine) / number)] for k in range(number))
        ranked += [mine[i] for i in order]
    home = {token: i for i, group in enumerate(groups) for token in group}
    # A row without constants leaves both splits a choice.
    _mend(held, ranked, [{home[token] for token in set().union(*rows)} for rows in constants if all(rows)])
    return {token for i in held for token in groups[i]}


def _mend(held: set[int], ranked: Sequence[int], choices: Sequence[set[int]]) -> None:
    """Where a dimension is left without a choice in one of the splits, move a group, if no other dimension suffers.
    `choices`: the groups that each dimension chooses from."""
    choices = sorted(choices, key=len)

    def lacking(held_out: set[int]) -> int:
        return sum((not own & held_out) + (not own - held_out) for own in choices)

    for own in choices:
        if not own & held or not own - held:
            moved = min((held ^ {i} for i in ranked if i in own), key=lacking)
            if lacking(moved) < lacking(held):
                held ^= held ^ moved


def _family(constant: float | str) -> str:
    """Name that textures which look alike have in common: "wood" of "wood-3", the folder of a file."""
    return constant.rpartition("-")[0] or constant.rpartition("/")[0] if isinstance(constant, str) else ""


def _linked(sets: Sequence[set[T]]) -> list[set[T]]:
    """Union of all sets that have elements in common, directly or through others."""
    home: dict[T, set[T]] = {}
    for members in sets:
        union = set(members).union(*(home[member] for member in members if member in home))
        home.update(dict.fromkeys(union, union))
    return list({id(union): union for union in home.values()}.values())
