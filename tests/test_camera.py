import numpy as np
import pytest

from evslip.camera import MOUNTS, hand_camera
from evslip.config import load_config
from evslip.params import draw


@pytest.fixture(params=MOUNTS)
def params(request):
    return draw(load_config("simple", {"camera.mount": request.param}), 0)


def test_axes_are_right_handed_and_up_is_away_from_the_fingers(params):
    camera = hand_camera(params)
    assert camera.rotation.T @ camera.rotation == pytest.approx(np.eye(3))
    assert np.linalg.det(camera.rotation) == pytest.approx(1)
    assert camera.rotation[:, 1] == pytest.approx([0, 0, -1])


def test_tool_centre_is_seen_above_the_middle(params):
    camera = hand_camera(params)
    x, y, depth = camera.project((np.array([0, 0, 0.1034]) - camera.position) @ camera.rotation)
    assert (x, depth) == (pytest.approx(173), pytest.approx(0.27))
    assert y == pytest.approx(130 - 398 * 0.0266 / 0.27, abs=0.1)


def test_field_of_view_does_not_depend_on_resolution(params):
    for size in ((346, 260), (1280, 720)):
        camera = hand_camera(params, size)
        assert 2 * np.degrees(np.arctan(size[0] / 2 / camera.focal_px)) == pytest.approx(47)
