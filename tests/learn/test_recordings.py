"""Detectors on recordings that a person labelled: examined as on simulated samples."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from evslip.data.intervals import Interval
from evslip.data.record import Record
from evslip.learn.evaluation.predictions import Predictions, on_records
from evslip.utils.errors import DataError
from evslip.windows.label import Label
from evslip.windows.window_set import WindowEvents, WindowSettings
from slip_records import slip_record, turning


class Counts(torch.nn.Module):
    """Says slip of windows with more than 1500 events."""

    device = torch.device("cpu")

    def prepare(self, events: WindowEvents) -> torch.Tensor:
        return torch.tensor(float(len(events.t_us)))

    def forward(self, inputs: Any) -> torch.Tensor:
        score = torch.as_tensor(inputs, dtype=torch.float32) - 1500
        return torch.stack([-score, score], 1) / 100


def by_hand(record: Record) -> Record:
    """No poses, no truth, but what is slip and what is hold."""
    spans = (Interval(100_000, 650_000, "hold"), Interval(720_000, 1_680_000, "slip"))
    return replace(record, kind="recording", split=None, truth=None, intervals=spans)


def ask(records: list[Record]) -> Predictions:
    network: Any = Counts()
    return on_records(network, WindowSettings(), records, hop_s=0.02)


def test_a_labelled_recording_is_answered_in_its_intervals():
    sample = by_hand(slip_record("a", turning(700, 1700, 20.0)))
    answers = ask([sample, replace(sample, name="b")])
    each = [(100_000 + 20_000 * k, Label.HOLD) for k in range(20)]
    each += [(720_000 + 20_000 * k, Label.SLIP) for k in range(41)]
    assert list(zip(answers.start_us.tolist(), answers.label.tolist(), strict=True)) == 2 * each
    assert [track.onset_us for track in answers.tracks] == [720_000, 720_000]
    assert ((answers.p_slip > 0.5) == (answers.label == Label.SLIP)).mean() > 0.95
    assert np.isnan(answers.rotation_deg).all()
    assert not answers.recent[:20].any()


def test_the_truth_of_a_simulated_one_gives_nearly_the_same():
    record = slip_record("a", turning(700, 1700, 20.0))
    person, truth = ask([by_hand(record)]), ask([record])
    common, mine, theirs = np.intersect1d(person.start_us, truth.start_us, return_indices=True)
    assert len(common) > 50
    np.testing.assert_array_equal(person.label[mine], truth.label[theirs])
    np.testing.assert_array_equal(person.p_slip[mine], truth.p_slip[theirs])


def test_recordings_without_labels_are_passed_over():
    bare = replace(by_hand(slip_record("a", turning(700, 1700, 20.0))), intervals=())
    with pytest.raises(DataError, match="truth or labels"):
        ask([bare])
