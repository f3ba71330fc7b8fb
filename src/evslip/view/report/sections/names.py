"""How sections name things."""

from evslip.data.record import Record
from evslip.view.pictures import figures
from evslip.view.report import page


def swatch(label: str) -> str:
    """A square of a label's colour."""
    color = {"slip": figures.SLIP_COLOR, "hold": figures.HOLD_COLOR}.get(label, figures.UNKNOWN_COLOR)
    return f'<span class="swatch" style="background: {color}"></span>'


def describe(label: str, record: Record) -> str:
    """A line about a sample, as HTML."""
    onset, params = record.onset_us, record.params
    if params is None or record.truth is None:
        seconds = (int(record.events.t_us[-1]) - int(record.events.t_us[0])) / 1e6 if record.events.count else 0.0
        facts = [f"{seconds:.2f} s", *record.notes.values()]
    else:
        facts = [
            f"{1000 * params.object.mass_kg:.3g} g",
            f"grip {params.grip.force_n:.3g} N, friction {params.grip.friction:.2g}",
            "never slips" if onset is None else f"slips from {onset / 1e6:.2f} s",
            f"turns by at most {float(record.truth.theta_deg[record.truth.held].max(initial=0)):.3g}°",
        ]
    return page.text(f"{label}: {', '.join([record.name, *facts])}")


def short(number: float) -> str:
    """A number in three digits with k, M or G, and a space."""
    for limit, suffix in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if number >= limit:
            return f"{number / limit:.3g} {suffix}"
    return f"{number:.3g} "
