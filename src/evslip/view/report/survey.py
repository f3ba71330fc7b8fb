"""Facts on every sample for the report, found in one pass that leaves simulated events on the disk."""

from typing import Any, NamedTuple

import numpy as np

from evslip.config.params import Params
from evslip.data.samples import Samples
from evslip.physics.truth import Truth
from evslip.utils.progress import over
from evslip.view.report.facts import doubt_of, facts_of

MOST_TRUTHS = 62
"""Samples whose truth is kept, to draw their angles."""


class Surveyed(NamedTuple):
    """One sample, in short."""

    position: int
    """In the data set."""
    name: str
    split: str
    """Empty for a recording."""
    label: str
    events: int
    params: Params | None
    facts: dict[str, Any]
    """Facts by `facts_of`; of a recording its length in seconds."""
    doubt: str
    truth: Truth | None


def survey(dataset: Samples) -> list[Surveyed]:
    """All samples in the order of the data set. Raises DataError."""
    return [_surveyed(dataset, position) for position in over("samples", range(len(dataset)))]


def spread(found: list[Surveyed], most: int) -> list[Surveyed]:
    """At most so many of the samples, evenly, each label in its share."""
    by_label = sorted(found, key=lambda sample: sample.label)
    chosen = np.unique(np.linspace(0, len(found) - 1, min(most, len(found))).round().astype(int)) if found else []
    return sorted((by_label[int(i)] for i in chosen), key=lambda sample: sample.position)


def _surveyed(dataset: Samples, position: int) -> Surveyed:
    listed = dataset.listing[position]
    record = dataset.read(position, events=listed.events is None)
    label = listed.label or record.label
    if record.kind == "recording":
        times = record.events.t_us
        seconds = float(times[-1] - times[0]) / 1e6 if len(times) else 0.0
        return Surveyed(position, record.name, "", label, len(times), None, {"seconds": seconds}, "", None)
    facts = facts_of(record)
    events = record.events.count if listed.events is None else listed.events
    truth = record.truth if position < MOST_TRUTHS else None
    split = listed.split or record.split or ""
    return Surveyed(position, record.name, split, label, events, record.params, facts, doubt_of(label, facts), truth)
