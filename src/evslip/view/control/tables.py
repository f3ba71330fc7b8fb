"""Tables of how well controllers hold: a head and lines of texts, for the page and for a terminal."""

from collections.abc import Mapping

from evslip.control.evaluation.summary import Figure
from evslip.view.report import page


def figure_table(found: Mapping[str, Mapping[str, Figure]]) -> list[list[str]]:
    """A line a figure, a column a controller; figures that none has are left out."""
    names = list(found)
    if not names:
        return [[""]]
    lines = [[title, *(_cell(found[name][title]) for name in names)] for title in found[names[0]]]
    return [["", *names], *(line for line in lines if set(line[1:]) != {"–"})]


def _cell(figure: Figure) -> str:
    digits = 1 if abs(figure.value) >= 10 else 2
    text = page.number(figure.value, digits)
    if figure.interval is None:
        return text
    low, high = (page.number(end, digits) for end in figure.interval)
    return f"{text} ({low}–{high})"
