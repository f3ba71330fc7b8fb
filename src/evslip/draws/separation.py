"""Proof by drawing that training and testing have no value in common."""

from collections import defaultdict
from collections.abc import Iterator, Mapping
from operator import attrgetter
from typing import Any, NamedTuple

from evslip.config.config import Config
from evslip.config.sample import OPTIONAL
from evslip.draws import provoked_slips
from evslip.draws.draw import draw
from evslip.draws.draw_plan import make_plan
from evslip.draws.splits import TEXTURE, domain, is_divided
from evslip.scene.shapes import shape_class
from evslip.scene.shapes.shape import SIDES
from evslip.utils.progress import over


class Separation(NamedTuple):
    """Values that were drawn, by domain: a key, or "texture" for all textures of a scene."""

    values: dict[str, dict[str, set[Any]]]
    """Domain -> split -> every value that was drawn."""
    kinds: dict[str, dict[str, set[str]]]
    """Names that both splits have, such as kinds of slip."""

    def shared(self) -> dict[str, set[Any]]:
        """Domain -> values that occur in both splits; nothing if all is well."""
        common = {name: drawn["train"] & drawn["test"] for name, drawn in self.values.items()}
        return {name: values for name, values in common.items() if values}

    def report(self) -> Iterator[str]:
        """Lines for a person."""
        wide = max(map(len, [*self.values, *self.kinds]))
        yield f"{'key':{wide}}  {'train':>7}  {'test':>7}  {'shared':>7}"
        for name, drawn in self.values.items():
            common = len(drawn["train"] & drawn["test"])
            yield f"{name:{wide}}  {len(drawn['train']):7,}  {len(drawn['test']):7,}  {common:7,}"
        for name, drawn in self.kinds.items():
            yield f"{name:{wide}}  {len(drawn['train']):7,}  {len(drawn['test']):7,}  both splits have every kind"


def separate(config: Config, counts: Mapping[str, int]) -> Separation:
    """Draw the first samples of each split, `counts` = {"train": n, "test": m}, and collect what varies.

    A key that one kind of slip sets to a constant is not drawn there, and does not count. Raises ConfigError.
    """
    values: dict[str, dict[str, set[Any]]] = defaultdict(lambda: {split: set() for split in counts})
    kinds: dict[str, dict[str, set[str]]] = defaultdict(lambda: {split: set() for split in counts})
    for split, count in counts.items():
        for index in over(f"{split} samples", range(count)):
            params = draw(config, index, split)
            for key in _drawn_keys(config, index, split):
                section = key.partition(".")[0]
                if section in OPTIONAL and getattr(params, section).is_default:
                    continue  # one of the samples that are without it
                if _is_computed(key, params.object):
                    continue
                value = attrgetter(key)(params)
                home = values if is_divided(key, value) else kinds
                home[domain(key)][split].add(value)
    return Separation(dict(values), dict(kinds))


def _drawn_keys(config: Config, index: int, split: str) -> list[str]:
    keys = make_plan(provoked_slips.prepare(config, index, split)).varied()
    is_weighed = config.slip_fraction is not None or config.slip.kind != provoked_slips.NATURAL
    keys += ["object.mass_kg"] if is_weighed and "object.mass_kg" not in keys else []
    return keys + (["slip.kind"] if isinstance(config.slip.kind, tuple) else [])


def _is_computed(key: str, spec: Any) -> bool:
    """Whether a key is a dimension of the object that follows from others, which are compared themselves."""
    section, _, name = key.partition(".")
    return section == "object" and name in SIDES and name not in shape_class(spec).own_sides(spec)


def textures_of(separation: Separation) -> dict[str, int]:
    """Number of different textures in each split."""
    return {split: len(names) for split, names in separation.values.get(TEXTURE, {}).items()}
