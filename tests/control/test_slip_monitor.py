"""Slips while they happen, against the ground truth of the whole motion."""

import numpy as np
import pytest

import evslip
from evslip.control.slip_monitor import SlipMonitor
from evslip.physics.truth import measure

QUICK = {"robot.kind": "cartesian", "motion.duration_s": 4.0}


def part(trajectory, first, last):
    columns = {
        name: value[first:last]
        for name, value in trajectory._asdict().items()
        if name != "params" and value is not None
    }
    return trajectory._replace(**columns)


def followed(trajectory, closed, step):
    monitor = SlipMonitor(part(trajectory, closed - 5, closed + 1))
    for first in range(closed, len(trajectory.t_us) - 1, step):
        monitor.push(part(trajectory, first, first + step + 1))
    return monitor


@pytest.fixture(scope="module", params=["rotation", "translation", "hold"])
def sample(request):
    config = evslip.load_config("complex", QUICK | {"slip.kind": request.param})
    for index in range(20):
        try:
            trajectory = evslip.simulate(evslip.draw(config, index))
            truth = measure(trajectory)
        except evslip.EvslipError:
            continue
        if truth.held.any() and not any(episode.kind == "drop" for episode in truth.episodes):
            last = int(np.flatnonzero(truth.held)[-1]) + 1
            return part(trajectory, 0, last), truth
    raise AssertionError("no sample can be played")


def test_angle_and_way_are_those_of_the_truth(sample):
    trajectory, truth = sample
    closed = int(np.searchsorted(truth.t_us, truth.span_us[0]))
    monitor = followed(trajectory, closed, 10)
    t_us, theta, slide = monitor.path()
    there = np.isin(truth.t_us, t_us)
    assert len(t_us) == there.sum() == len(trajectory.t_us) - closed
    assert np.abs(slide - truth.slide_mm[there]).max() < 0.01
    about_closing_axis = np.abs(truth.spin_deg[there])
    assert (theta >= about_closing_axis - 0.01).all()
    assert np.median(np.abs(theta - about_closing_axis)) < 0.1
    assert monitor.theta_deg == theta[-1] and monitor.slide_mm == slide[-1]


def test_slips_are_those_of_the_truth(sample):
    trajectory, truth = sample
    monitor = followed(trajectory, int(np.flatnonzero(truth.held)[0]), 10)
    found = [slide for slide in monitor.slides if slide.is_slip]
    assert len(found) == monitor.slips
    assert bool(found) == bool(truth.episodes)
    if found:
        first = truth.episodes[0]
        assert abs(found[0].onset_us - first.start_us) <= 100_000
        largest = max(slide.rotation_deg for slide in found)
        assert largest == pytest.approx(max(e.rotation_deg for e in truth.episodes), rel=0.1, abs=0.2)


def test_the_steps_in_which_samples_come_do_not_matter(sample):
    trajectory, truth = sample
    closed = int(np.searchsorted(truth.t_us, truth.span_us[0]))
    one, other = (followed(trajectory, closed, step) for step in (1, 50))
    assert one.slides == other.slides
    assert all(np.array_equal(a, b) for a, b in zip(one.path(), other.path(), strict=True))
