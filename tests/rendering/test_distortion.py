import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.rendering import frame_times
from evslip.rendering.camera import Camera, hand_camera
from evslip.rendering.distortion import Distortion
from evslip.rendering.poses import ScenePoses
from evslip.utils.errors import ConfigError
from lenses import BARREL, PINCUSHION
from made_up import still

lenses = st.builds(
    Distortion, st.floats(-0.4, 0.4), st.floats(0.0, 0.2), st.floats(-0.02, 0.02), st.floats(-0.02, 0.02)
)
places = st.floats(-0.45, 0.45)


OPENCV = [
    ((0.1, -0.2, 1.0), (211.692, 52.016)),
    ((-0.4, 0.3, 1.0), (18.28, 245.54)),
    ((0.35, 0.28, 0.7), (346.7544, 273.26752)),
    ((0.0, 0.25, 0.5), (171.0, 319.5)),
]
"""Points (right, down, ahead) and where cv2.projectPoints of OpenCV 5.0.0 sees them with focal length 400, principal
point (173, 130) and coefficients -0.3, 0.12, 0.01, -0.02."""


def camera_of(lens, size=None):
    return hand_camera(draw(load_config("simple", lens), 0), size)


@pytest.mark.parametrize(("point", "image"), OPENCV)
def test_points_are_where_opencv_sees_them(point, image):
    camera = Camera(np.zeros(3), np.eye(3), 346, 260, 400.0, Distortion(-0.3, 0.12, 0.01, -0.02))
    right, down, ahead = point
    assert camera.project(np.array([right, -down, -ahead])) == pytest.approx((*image, ahead), abs=1e-9)


@given(lenses, places, places)
def test_the_inverse_takes_the_lens_back(lens, x, y):
    assert lens.undistort(*lens.distort(np.array(x), np.array(y))) == pytest.approx((x, y), abs=1e-9)


@given(lenses, places, places)
def test_the_jacobian_is_the_derivative(lens, x, y):
    step = 1e-6
    along_x = np.subtract(lens.distort(x + step, y), lens.distort(x - step, y)) / (2 * step)
    along_y = np.subtract(lens.distort(x, y + step), lens.distort(x, y - step)) / (2 * step)
    assert lens.jacobian(np.array(x), np.array(y)) == pytest.approx(np.stack([along_x, along_y], 1), abs=1e-8)


@pytest.mark.parametrize("lens", [BARREL, PINCUSHION], ids=["barrel", "pincushion"])
def test_rays_and_projection_are_inverse(lens):
    camera = camera_of(lens)
    x, y, depth = np.moveaxis(camera.project(0.3 * camera.rays()), -1, 0)
    assert np.abs(x - (np.arange(camera.width) + 0.5)).max() < 1e-8
    assert np.abs(y - (np.arange(camera.height) + 0.5)[:, None]).max() < 1e-8
    assert depth == pytest.approx(0.3)


@pytest.mark.parametrize("lens", [BARREL, PINCUSHION], ids=["barrel", "pincushion"])
def test_the_pinhole_sees_all_that_the_lens_sees_and_little_more(lens):
    camera = camera_of(lens)
    pinhole = camera.pinhole()
    image = pinhole.project(camera.rays())
    assert image[..., :2].min() > 1 and np.all(image[..., :2].max((0, 1)) < (pinhole.width - 1, pinhole.height - 1))
    assert image[..., :2].min() < 3 or np.any(image[..., :2].max((0, 1)) > (pinhole.width - 3, pinhole.height - 3))
    assert (pinhole.width - camera.width) % 2 == 0 and (pinhole.height - camera.height) % 2 == 0
    assert (pinhole.width > camera.width) == (lens is BARREL)


def test_without_distortion_the_camera_is_its_own_pinhole():
    camera = camera_of({})
    assert camera.pinhole() is camera and camera.stretch() == 1


@pytest.mark.parametrize("lens", [{"camera.k1": -0.9}, {"camera.k2": -1.0, "camera.fov_deg": 90.0}])
def test_a_lens_that_folds_the_image_is_refused(lens):
    with pytest.raises(ConfigError, match=r"camera\.k1 .*folds the image"):
        camera_of(lens)


def test_no_point_of_the_table_moves_farther_than_the_limit_under_a_pincushion():
    params = draw(load_config("simple", PINCUSHION), 0)
    traj, camera = still(params), hand_camera(params)
    for poses in (traj.gripper_pose, traj.object_pose):  # held: only what is behind them moves in the image
        poses[:, 0] += 0.1 * traj.t_us * 1e-6
    assert camera.stretch() > 1.1
    times = frame_times(traj, 0, 1_000_000, max_motion_px=0.5)
    poses = ScenePoses(traj, camera, times)
    x, y = np.meshgrid(np.linspace(0.2, 0.8, 41), np.linspace(-0.1, 0.5, 61))
    world = np.stack([x, y, 0 * x], -1).reshape(-1, 3)
    local = (world - poses.camera_position[:, None]) @ poses.camera_rotation
    image = camera.project(local)
    inside = np.all((image[..., :2] > 0) & (image[..., :2] < (camera.width, camera.height)), -1)
    moved = np.linalg.norm(np.diff(image[..., :2], axis=0), axis=-1)[inside[1:] & inside[:-1]]
    assert 0.4 < moved.max() <= 0.5
