"""What object and gripper hide of the lamp, against many rays to it: of several bodies, the darkest counts."""

from functools import partial

import numpy as np
import pytest

from brute_force import cuboid, seen_share
from evslip.rendering.geometry.hand import FINGERS, box_parts, shadow_boxes
from evslip.rendering.shadows.casters import OBJECT_PART
from shadows import seen

DOWN = np.diag([1.0, -1.0, -1.0])
PARTS = np.array([OBJECT_PART, *box_parts(FINGERS)])


def lamp_at(polar, azimuth):
    polar, azimuth = np.radians([polar, azimuth])
    return 30 * np.array([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)])


def grasp(height=0.06):
    """Turns, places and halves of an object held over the table, and of the gripper's boxes."""
    boxes, hand = shadow_boxes(0.02), np.array([0.45, 0.0, height + 0.1034 + 0.04])
    return (
        np.concatenate([np.eye(3)[None], DOWN @ boxes.turns]),
        np.concatenate([[[0.45, 0.0, height]], hand + boxes.places @ DOWN]),
        np.concatenate([[[0.03, 0.02, 0.05]], boxes.halves]),
    )


def table_points(rng, lamp, count):
    over = rng.uniform(-0.2, 0.2, (count, 2)) + np.array([0.45, 0.0]) - 0.1 * lamp[:2] / lamp[2]
    return np.concatenate([over, np.zeros((count, 1))], 1)


@pytest.mark.parametrize(("polar", "azimuth"), [(40.0, 60.0), (15.0, 200.0), (65.0, 100.0)])
@pytest.mark.parametrize(("radius", "mean", "most"), [(1.0, 0.02, 0.22), (3.0, 0.1, 0.35)])
def test_the_shadow_of_object_and_gripper_is_about_that_of_rays(polar, azimuth, radius, mean, most):
    rng, lamp, boxes = np.random.default_rng(0), lamp_at(polar, azimuth), grasp()
    points = table_points(rng, lamp, 1000)
    casters = [(place, turn, partial(cuboid, half)) for turn, place, half in zip(*boxes, strict=True)]
    rays = seen_share(points, lamp, radius, casters, 300, rng)
    error = np.abs(seen(points, lamp, radius, boxes, PARTS) - rays)[rays < 0.98]
    assert len(error) > 50
    assert error.mean() < mean
    assert np.quantile(error, 0.99) < most


@pytest.mark.parametrize(("radius", "most"), [(1.0, 0.006), (1.9, 0.006), (5.0, 0.006)])
def test_shares_of_the_lamp_pass_on_smoothly(radius, most):
    """Along a line through the common penumbra no step stands out from its neighbours."""
    lamp, boxes, across = lamp_at(40.0, 60.0), grasp(), np.zeros((2000, 3))
    across[:, 0], across[:, 1] = np.linspace(0.35, 0.5, 2000), np.linspace(-0.2, 0.05, 2000)
    shares = seen(across, lamp, radius, boxes, PARTS)
    assert np.ptp(shares) > 0.8
    steps = np.abs(np.diff(shares))
    assert np.max(steps[1:-1] - np.maximum(steps[:-2], steps[2:])) < most


def test_a_body_casts_no_shadow_on_itself():
    lamp, boxes = np.array([0.0, 0.0, 30.0]), grasp()
    under = np.array([[0.45, 0.03, 0.0]])
    parts = np.full(9, 2)
    assert seen(under, lamp, 1.0, boxes, parts, own=2)[0] == 1
    assert seen(under, lamp, 1.0, boxes, parts, own=1)[0] < 1


def test_what_lies_behind_a_point_hides_nothing_from_it():
    """A finger's front, half in the palm's shadow, before the object: what the lamp shows of it is the same without."""
    lamp, point = np.array([0.0, 0.0, 30.0]), np.array([[0.45, 0.0, 0.2]])
    places = np.array([[0.45, 0.1, 0.3], [0.45, 0.0, 0.17]])
    boxes = np.stack([np.eye(3)] * 2), places, np.array([[0.1, 0.1, 0.02], [0.015, 0.025, 0.03 - 1e-4]])
    alone = seen(point, lamp, 3.0, tuple(values[:1] for values in boxes), [0], layered=True)
    assert 0.2 < alone[0] < 0.8
    assert seen(point, lamp, 3.0, boxes, [0, 1], layered=True)[0] == pytest.approx(alone[0], abs=1e-3)


@pytest.mark.parametrize("radius", [0.3, 3.0])
def test_a_body_hides_alike_where_it_stands_and_a_little_above(radius):
    """Also from pixels that reach under it: far away, they are longer than the body."""
    turns, places, halves = grasp(height=0.05)
    lifted = places + np.array([0.0, 0.0, 1e-4])
    lamp, steps = lamp_at(25.0, 150.0), [[0.0017, 0, 0], [-0.003, -0.019, 0]]
    points = np.array([[x, y, 0.0] for x in np.linspace(0.4, 0.5, 21) for y in (-0.03, -0.024, 0.024, 0.03)])
    stands = seen(points, lamp, radius, (turns, places, halves), PARTS, steps=steps)
    assert 0.1 < stands.mean() < 0.9
    np.testing.assert_allclose(
        seen(points, lamp, radius, (turns, lifted, halves), PARTS, steps=steps), stands, atol=0.02
    )
