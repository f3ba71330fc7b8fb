"""Scores of estimated speeds of slip on estimates whose errors are known."""

import numpy as np
import pytest

from evslip.learn.scores.speed import LEAST_SPEED, speed_scores
from evslip.learn.speed_estimate import SpeedEstimate


def test_an_estimate_that_is_as_uncertain_as_it_says() -> None:
    rng = np.random.default_rng(0)
    median = np.expm1(rng.uniform(2.5, 6, 50_000))
    true = np.expm1(rng.laplace(np.log1p(median), 0.2))
    found = speed_scores(true, SpeedEstimate(median, np.full(len(true), 0.2)))
    assert found is not None and found.windows == (true > LEAST_SPEED).sum()
    assert found.coverage_68 == pytest.approx(0.68, abs=0.01) and found.coverage_90 == pytest.approx(0.9, abs=0.01)
    assert found.median_error == pytest.approx(0.2 * np.log(2), rel=0.1)
    assert 0.95 < found.correlation < 1


def test_slow_and_unknown_windows_do_not_count() -> None:
    true = np.array([0.0, 1.0, 10.0, 20.0, 15.0, np.nan])
    estimate = SpeedEstimate(np.array([0.5, 9.0, 11.0, 30.0, 15.3, 7.0]), np.full(6, 0.05))
    found = speed_scores(true, estimate)
    assert found is not None
    assert (found.windows, found.coverage_68, found.coverage_90) == pytest.approx((3, 1 / 3, 2 / 3))
    assert found.median_error == pytest.approx(0.1)
    expected = np.corrcoef(np.log1p(true[2:5]), np.log1p(estimate.median[2:5]))[0, 1]
    assert found.correlation == pytest.approx(expected)


def test_without_fast_windows_without_truth_and_without_estimate() -> None:
    still, estimate = np.zeros(3), SpeedEstimate(np.ones(3), np.ones(3))
    found = speed_scores(still, estimate)
    assert found is not None and found.windows == 0
    assert np.isnan([found.median_error, found.coverage_68, found.coverage_90, found.correlation]).all()
    assert speed_scores(np.full(3, np.nan), estimate) is None
    assert speed_scores(still, SpeedEstimate(np.full(3, np.nan), np.full(3, np.nan))) is None
