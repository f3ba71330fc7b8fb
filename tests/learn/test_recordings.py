"""Detectors on recordings that a person labelled: examined as on simulated samples."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from evslip.data.intervals import Interval
from evslip.data.record import Record
from evslip.learn.evaluation.alarms import alarms_at
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
    first_us = int(sample.events.t_us[0])
    each = [(start, Label.UNCERTAIN) for start in range(-40_000, 100_000, 20_000) if start >= first_us]
    before = len(each)
    assert before >= 4
    each += [(100_000 + 20_000 * k, Label.HOLD) for k in range(20)]
    each += [(580_000 + 20_000 * k, Label.UNCERTAIN) for k in range(7)]
    each += [(720_000 + 20_000 * k, Label.SLIP) for k in range(41)]
    assert list(zip(answers.start_us.tolist(), answers.label.tolist(), strict=True)) == 2 * each
    assert [track.onset_us for track in answers.tracks] == [720_000, 720_000]
    sure = answers.label != Label.UNCERTAIN
    assert ((answers.p_slip > 0.5) == (answers.label == Label.SLIP))[sure].mean() > 0.95
    assert np.isnan(answers.rotation_deg).all()
    assert not answers.recent[: before + 20].any()
    assert not answers.counted[~sure].any()


def test_a_slip_that_a_person_labelled_is_detected_as_soon_as_a_simulated_one():
    """Also where the person labelled less of it than a window."""
    record = slip_record("a", turning(700, 1700, 20.0))
    assert record.truth is not None and record.truth.onset_us is not None
    onset_us = record.truth.onset_us
    for end_us in (1_680_000, onset_us + 120_000):
        spans = (Interval(100_000, onset_us, "hold"), Interval(onset_us, end_us, "slip"))
        person = alarms_at(ask([replace(by_hand(record), intervals=spans)]), 0.5)
        truth = alarms_at(ask([record]), 0.5)
        assert (person.slips, truth.slips) == (1, 1)
        assert 0 < truth.latency_s[0] < 0.1
        assert abs(person.latency_s[0] - truth.latency_s[0]) <= 0.02


def test_the_truth_of_a_simulated_one_gives_nearly_the_same():
    record = slip_record("a", turning(700, 1700, 20.0))
    person, truth = ask([by_hand(record)]), ask([record])
    common, mine, theirs = np.intersect1d(person.start_us, truth.start_us, return_indices=True)
    assert len(common) > 50
    sure = person.label[mine] != Label.UNCERTAIN
    assert sure.sum() > 50
    np.testing.assert_array_equal(person.label[mine][sure], truth.label[theirs][sure])
    np.testing.assert_array_equal(person.p_slip[mine], truth.p_slip[theirs])


def test_recordings_without_labels_are_passed_over():
    bare = replace(by_hand(slip_record("a", turning(700, 1700, 20.0))), intervals=())
    with pytest.raises(DataError, match="truth or labels"):
        ask([bare])
