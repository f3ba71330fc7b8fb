"""Pictures of windows that detectors fail on, drawn from what they were examined on."""

from collections.abc import Iterable, Iterator

import numpy as np

from evslip.events.stream import Events
from evslip.learn.evaluation.evaluation_data import EvaluationData
from evslip.view.evaluation.failures import Failure, of_events, of_record
from evslip.windows.settings import Align
from evslip.windows.window_set import WindowSettings


def pictures(
    data: EvaluationData, found: Iterable[Failure], settings: WindowSettings, align: Align = "centre"
) -> Iterator[tuple[Failure, np.ndarray]]:
    """Each window once, with its picture; `settings` are those of the windows, `align` says how they lie on another
    sensor. Raises DataError."""
    wanted: dict[str, list[Failure]] = {}
    for failure in dict.fromkeys(failure._replace(p_slip=0.0) for failure in found):
        wanted.setdefault(failure.name, []).append(failure)
    if data.windows is not None:
        yield from _of_windows(data, wanted)
        return
    for record in data.named(wanted):
        for failure in wanted.pop(record.name, ()):
            yield failure, of_record(record, failure.start_us, settings, align)


def _of_windows(data: EvaluationData, wanted: dict[str, list[Failure]]) -> Iterator[tuple[Failure, np.ndarray]]:
    cut = data.windows
    assert cut is not None  # asked before
    for failure in (one for some in wanted.values() for one in some):
        for i in np.flatnonzero((cut.name == failure.name) & (cut.start_us == failure.start_us))[:1]:
            t_us, x, y, p = cut[int(i)]
            yield failure, of_events(Events(t_us.astype(np.int64), x, y, p), cut.settings)
