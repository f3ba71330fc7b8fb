"""How far the objects turn in the hand, over time."""

from collections.abc import Mapping, Sequence

from evslip.data.record import Record
from evslip.physics.motion.phases import phase_times
from evslip.physics.truth import Truth
from evslip.view.pictures import figures
from evslip.view.report import page
from evslip.view.report.sections.strips import UNSHOWN
from evslip.windows.window_set import WindowSettings


def angles(examples: Mapping[str, Record], others: Sequence[Truth], settings: WindowSettings) -> str:
    """The two samples before the others, with the thresholds of the labels."""
    if not examples or any(record.params is None for record in examples.values()):
        return ""
    first = next(iter(examples.values()))
    slip, hold = (examples[label].truth if label in examples else None for label in ("slip", "hold"))
    assert first.params is not None  # a simulated record has them
    phases = {name: span for name, span in phase_times(first.params).items() if name not in UNSHOWN}
    figure = figures.theta(slip, hold, others, phases, (settings.hold_deg, settings.slip_deg))
    sliding = f" (or by its sliding, {settings.slip_mm:g} mm and {settings.hold_mm:g} mm)"
    note = (
        "How far the object has turned in the hand since the grip closed. A window is slip or hold by its change of "
        f"this angle: at least {settings.slip_deg:g}° or less than {settings.hold_deg:g}° in {settings.labelled_s:g} s"
        f"{sliding if settings.labels == 'motion' else ''}. "
        "Shaded: the object of the sample of that colour is held, free of the surface."
    )
    button = '<button data-scale="theta">linear axis</button>'
    return page.section("Angular difference over time", note, button + page.embed("theta", figure))
