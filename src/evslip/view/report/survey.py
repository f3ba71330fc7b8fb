"""What the report says of every sample, found in one pass that leaves simulated events on the disk."""

from typing import Any, NamedTuple

import numpy as np

from evslip.config.params import Params
from evslip.data.dataset import Dataset
from evslip.data.recordings import Recordings
from evslip.physics.truth import Truth
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
    """Of `facts_of`; of a recording how long it is, as seconds."""
    doubt: str
    truth: Truth | None


def survey(dataset: Dataset | Recordings) -> list[Surveyed]:
    """All samples in the order of the data set. Raises DataError."""
    return [_recording(dataset, i) if isinstance(dataset, Recordings) else _sample(dataset, i, entry)
            for i, entry in enumerate(_entries(dataset))]  # fmt: skip


def spread(found: list[Surveyed], most: int) -> list[Surveyed]:
    """At most so many of the samples, evenly, each label in its share."""
    by_label = sorted(found, key=lambda sample: sample.label)
    chosen = np.unique(np.linspace(0, len(found) - 1, min(most, len(found))).round().astype(int)) if found else []
    return sorted((by_label[int(i)] for i in chosen), key=lambda sample: sample.position)


def _entries(dataset: Dataset | Recordings) -> list[Any]:
    if isinstance(dataset, Recordings):
        return list(dataset.files)
    return [entry for entry in dataset.entries if entry["kind"] == "simulated"]


def _sample(dataset: Dataset, position: int, entry: Any) -> Surveyed:
    record, label = dataset.read(position, events=False), entry.get("label", "hold")
    facts = facts_of(record)
    truth = record.truth if position < MOST_TRUTHS else None
    return Surveyed(
        position, record.name, entry["split"], label, entry["events"], record.params, facts, doubt_of(label, facts),
        truth,
    )  # fmt: skip


def _recording(dataset: Recordings, position: int) -> Surveyed:
    record = dataset.read(position)
    times = record.events.t_us
    seconds = float(times[-1] - times[0]) / 1e6 if len(times) else 0.0
    return Surveyed(position, record.name, "", record.label, len(times), None, {"seconds": seconds}, "", None)
