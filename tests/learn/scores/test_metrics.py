"""Scores against their definitions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evslip.learn.scores.metrics import auroc, best_threshold, confusion, measure
from slip_records import slip_windows

answers = st.lists(st.tuples(st.booleans(), st.integers(0, 10)), min_size=1, max_size=60).map(
    lambda pairs: (np.array([p[0] for p in pairs], np.uint8), np.array([p[1] for p in pairs]) / 10)
)


@given(answers)
def test_auroc_is_the_chance_that_a_slip_scores_higher(pairs) -> None:
    labels, scores = pairs
    slip, hold = scores[labels == 1], scores[labels == 0]
    if not len(slip) or not len(hold):
        assert np.isnan(auroc(labels, scores))
        return
    wins = (slip[:, None] > hold).mean() + (slip[:, None] == hold).mean() / 2
    assert auroc(labels, scores) == pytest.approx(wins)
    assert auroc(labels, 1 - scores) == pytest.approx(1 - wins)


@given(answers)
def test_confusion_counts_every_answer_once(pairs) -> None:
    labels, scores = pairs
    said = scores >= 0.5
    table = confusion(labels, said)
    for truth in (0, 1):
        for answer in (0, 1):
            assert table[truth, answer] == ((labels == truth) & (said == answer)).sum()


def test_scores_of_known_answers() -> None:
    windows = slip_windows(4)
    perfect = measure(windows, windows.label.astype(np.float32), 0.5)
    number = len(windows) // 2
    assert perfect.confusion == [[number, 0], [0, number]]
    assert perfect.accuracy == perfect.balanced_accuracy == perfect.f1 == perfect.auroc == perfect.without_recent == 1.0
    always = measure(windows, np.ones(len(windows), np.float32), 0.5)
    assert (always.accuracy, always.auroc, always.f1) == (0.5, 0.5, pytest.approx(2 / 3))
    assert perfect.labels == windows.label.tolist() and perfect.names == windows.name.tolist()
    assert str(len(windows)) in perfect.table()


def test_a_few_trajectories_do_not_move_the_threshold_far():
    # Told right by a threshold of 0.96, and all but one by 0.5: four trajectories are no reason to prefer the former.
    labels = np.array([0] * 10 + [1] * 10)
    scores = np.array([0.01] * 9 + [0.95] + [0.97] * 10)
    assert best_threshold(labels, scores, np.repeat(["a", "b", "c", "d"], 5)) == 0.5
    # Many trajectories are; and where 0.5 tells nothing, any number of them.
    assert best_threshold(labels.repeat(50), scores.repeat(50), np.arange(1000)) > 0.9
    assert best_threshold(labels, 0.4 * scores, np.repeat(["a", "b", "c", "d"], 5)) < 0.4
