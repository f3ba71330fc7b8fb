"""Scores against scikit-learn and closed forms, and intervals against known distributions."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn import metrics as sk

from evslip.learn.scores import bootstrap, weighted

windows = st.lists(st.tuples(st.booleans(), st.integers(0, 12), st.integers(0, 3)), min_size=2, max_size=80).map(
    lambda rows: tuple(np.array(column) for column in zip(*rows, strict=True))
)
"""Labels, probabilities in twelfths, weights."""


@given(windows)
@settings(max_examples=60)
def test_every_score_is_that_of_scikit_learn(rows) -> None:
    labels, twelfths, weights = rows
    p_slip = twelfths / 12
    if not (weights[labels].sum() and weights[~labels].sum()):
        return
    drawn = {"sample_weight": weights}
    found = weighted.headline(weighted.distribution(labels.astype(int), p_slip, weights.astype(float)), 0.5)
    said = p_slip >= 0.5
    expected = {
        "accuracy": sk.accuracy_score(labels, said, **drawn),
        "balanced_accuracy": sk.balanced_accuracy_score(labels, said, **drawn),
        "f1": sk.f1_score(labels, said, **drawn),
        "auroc": sk.roc_auc_score(labels, p_slip, **drawn),
        "auprc": sk.average_precision_score(labels, p_slip, **drawn),
        "brier": sk.brier_score_loss(labels, p_slip, **drawn),
    }
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, abs=1e-12), name


def test_probabilities_of_balanced_windows_are_right_at_another_share() -> None:
    """Bayes' rule: right where slips are as frequent as holds, right again where 1 of 20 windows slips."""
    rng = np.random.default_rng(0)
    labels = (rng.random(200_000) < 0.05).astype(int)
    odds = np.exp(rng.normal(np.where(labels, 1.0, -1.0)) * 2)  # ratio of two normal densities, 2 apart
    p_slip = odds / (1 + odds)
    plain, corrected = (
        weighted.calibration_error(weighted.distribution(labels, p))
        for p in (p_slip, weighted.at_share(p_slip, labels.mean()))
    )
    assert plain > 0.1 > 0.005 > corrected
    np.testing.assert_allclose(weighted.at_share(p_slip, 0.5), p_slip, rtol=1e-12)
    for share in (0.0, 1.0, np.nan):
        np.testing.assert_array_equal(weighted.at_share(p_slip, share), p_slip)
    # What learned from windows a third of which slip is as one that learned from halves, moved there.
    third = weighted.at_share(p_slip, 1 / 3)
    np.testing.assert_allclose(weighted.at_share(third, 0.1, 1 / 3), weighted.at_share(p_slip, 0.1), rtol=1e-9)
    for trained in (0.0, 1.0, np.nan):
        np.testing.assert_array_equal(weighted.at_share(p_slip, 0.1, trained), p_slip)


def test_many_weightings_at_once_are_those_one_by_one() -> None:
    rng = np.random.default_rng(0)
    labels, p_slip = rng.integers(0, 2, 200), rng.integers(0, 50, 200) / 50
    weights = rng.integers(0, 4, (7, 200))
    together = weighted.headline(weighted.distribution(labels, p_slip, weights), 0.3)
    for i, row in enumerate(weights):
        repeated = np.repeat(np.arange(200), row)
        alone = weighted.headline(weighted.distribution(labels[repeated], p_slip[repeated]), 0.3)
        for name, values in together.items():
            assert values[i] == pytest.approx(float(alone[name])), name


def test_calibration_error_in_closed_form() -> None:
    # 30 windows told 0.9, of which 0.7 slip; 10 told 0.1, of which none does: (30 * 0.2 + 10 * 0.1) / 40.
    labels = np.array([1] * 21 + [0] * 9 + [0] * 10)
    p_slip = np.array([0.9] * 30 + [0.1] * 10)
    assert weighted.calibration_error(weighted.distribution(labels, p_slip)) == pytest.approx(0.175)
    share, mean, weight = weighted.reliability(weighted.distribution(labels, p_slip))
    assert share[weight > 0].tolist() == pytest.approx([0.0, 0.7])
    assert mean[weight > 0].tolist() == pytest.approx([0.1, 0.9])


def test_calibrated_probabilities_have_a_small_error_and_the_brier_score_of_their_spread() -> None:
    rng = np.random.default_rng(1)
    p_slip = rng.random(100_000)
    found = weighted.distribution(rng.random(100_000) < p_slip, p_slip)
    assert weighted.calibration_error(found) < 0.01
    assert weighted.brier(found) == pytest.approx(1 / 6, abs=0.003)  # E[p (1 - p)] of a uniform p


def test_what_is_undefined_is_nan() -> None:
    one_class = weighted.headline(weighted.distribution(np.zeros(3, int), np.array([0.1, 0.2, 0.9])), 0.5)
    assert np.isnan(one_class["auroc"])
    assert one_class["balanced_accuracy"] == pytest.approx(2 / 3)
    assert one_class["f1"] == 0
    assert all(
        np.isnan(v)
        for k, v in weighted.headline(weighted.distribution(np.zeros(0), np.zeros(0)), 0.5).items()
        if k != "f1"
    )


def test_an_interval_of_the_mean_is_the_normal_one() -> None:
    rng = np.random.default_rng(2)
    trajectories, each = 200, 5
    # Windows of one trajectory are equal: only the 200 trajectories count, not the 1000 windows.
    right = np.repeat(rng.random(trajectories) < 0.7, each)
    which = np.repeat(np.arange(trajectories), each)
    counts = bootstrap.draws(trajectories, 4000, seed=3)
    assert (counts.sum(1) == trajectories).all()
    found = bootstrap.intervals(lambda w: {"share": (w * right).sum(-1) / w.sum(-1)}, which, counts)["share"]
    share = right.mean()
    half = 1.96 * np.sqrt(share * (1 - share) / trajectories)
    assert found == pytest.approx((share - half, share + half), abs=0.006)


def test_an_interval_covers_the_truth_as_often_as_it_says() -> None:
    rng, covered = np.random.default_rng(4), 0
    for repeat in range(200):
        level = rng.normal(0.5, 0.1, 40)  # each trajectory has its own mean, around 0.5
        values = (level[:, None] + rng.normal(0, 0.05, (40, 6))).ravel()
        counts = bootstrap.draws(40, 300, seed=repeat)
        means = {"mean": lambda w, values=values: (w * values).sum(-1) / w.sum(-1)}
        found = bootstrap.intervals(
            lambda w, means=means: {"mean": means["mean"](w)}, np.repeat(np.arange(40), 6), counts
        )["mean"]
        assert found is not None
        covered += found[0] <= 0.5 <= found[1]
    assert 0.88 <= covered / 200 <= 0.99


def test_no_interval_where_there_is_nothing_to_draw_from() -> None:
    def mean(weights):
        return {"mean": weights.sum(-1)}

    assert bootstrap.intervals(mean, np.zeros(5, int), bootstrap.draws(1)) == {"mean": None}
    assert bootstrap.intervals(mean, np.arange(5), bootstrap.draws(5, 0)) == {"mean": None}
    assert bootstrap.interval(np.array([np.nan, np.nan, 1.0])) is None
