"""One draw as a page of text: every parameter with its unit, what it was drawn from, and when the grasp should slip."""

from collections.abc import Iterator
from itertools import groupby
from typing import Any

from evslip.config.config import Config
from evslip.config.distributions import Uniform
from evslip.config.params import Params
from evslip.config.sample import leaves
from evslip.config.units import tell
from evslip.draws.draw import draw
from evslip.draws.stratification import SURE_HOLD, SURE_SLIP
from evslip.physics.motion.phases import hanging_phases

WIDTH = 110


def draw_sheet(config: Config, index: int, split: str = "train") -> str:
    """The draw of one sample. Raises ConfigError."""
    params = draw(config, index, split)
    rows = list(_rows(config, params))
    keys, values = (max(len(row[column]) for row in rows) for column in (0, 1))
    lines = [f"sample {split}/{index}, seed {config.seed}"]
    for _, section in groupby(rows, lambda row: row[0].partition(".")[0]):
        lines += ["", *(f"{key:{keys}}  {value:>{values}}  {source}".rstrip() for key, value, source in section)]
    return "\n".join([*lines, "", *_forecast(params)]) + "\n"


def _rows(config: Config, params: Params) -> Iterator[tuple[str, str, str]]:
    given = leaves(config)
    for key, value in leaves(params).items():
        if value is not None:
            yield key, tell(key, value), "" if given[key] == value else _source(key, given[key])


def _source(name: str, given: Any) -> str:
    """Distribution that a value was drawn from."""
    if isinstance(given, Uniform):
        return f"from {tell(name, given.min)} to {tell(name, given.max)}"
    if isinstance(given, tuple):
        text = "one of " + ", ".join(
            _source(name, entry).removeprefix("from ") if isinstance(entry, Uniform) else tell(name, entry)
            for entry in given
        )
        return text if len(text) <= WIDTH // 2 else f"one of {len(given)}"
    return f"one of {given}" if isinstance(given, str) else "chosen by the kind of slip"


def _forecast(params: Params) -> Iterator[str]:
    from evslip.physics.onset import onset_mass

    onset_kg = onset_mass(params)
    each = [f"{phase} {tell('_kg', onset_mass(params, (phase,)), 3)}" for phase in hanging_phases(params)]
    yield f"predicted onset  {tell('_kg', onset_kg, 3)}, the least of {', '.join(each)}"
    multiple = params.object.mass_kg / onset_kg
    if multiple <= SURE_HOLD:
        verdict = "it holds"
    else:
        verdict = "it slips" if multiple >= SURE_SLIP else "close to the onset: it may slip, or not"
    yield f"mass / onset     {multiple:.3g}: {verdict}"
