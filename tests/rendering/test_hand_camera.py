import numpy as np
import pytest

from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.rendering.camera import hand_camera
from evslip.scene.mounts import MOUNTS
from evslip.utils.errors import ConfigError, PlanRejected


@pytest.fixture(params=["side", "front"])
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


def custom(**values):
    overrides = {f"camera.{name}": value for name, value in values.items()}
    return hand_camera(draw(load_config("simple", {"camera.mount": "custom", **overrides}), 0))


@pytest.mark.parametrize("place", [(0.2, 0.15, 0.02), (-0.1, 0.2, 0.2), (0.0, -0.3, 0.1034)])
def test_a_custom_camera_sees_the_tool_centre_in_the_middle_and_upright(place):
    camera = custom(**dict(zip(("x_m", "y_m", "z_m"), place, strict=True)))
    assert camera.rotation.T @ camera.rotation == pytest.approx(np.eye(3))
    tool, above = (camera.project((np.array([0, 0, z]) - camera.position) @ camera.rotation) for z in (0.1034, 0.09))
    assert tool[:2] == pytest.approx([camera.width / 2, camera.height / 2])
    assert above[0] == pytest.approx(tool[0])
    assert above[1] < tool[1]


def test_a_custom_camera_in_the_grasp_is_refused():
    with pytest.raises(ConfigError, match=r"camera\.x_m 0\.02, camera\.y_m 0\.01: .* at least 0\.05 m"):
        custom(x_m=0.02, y_m=0.01, z_m=0.1)


@pytest.mark.parametrize(
    "keys",
    [
        {"camera.y_m": -0.25},
        {"camera.mount": "front", "camera.x_m": -0.26},
        {"camera.mount": "custom", "camera.x_m": 0.06, "camera.z_m": 0.12, "object.width_m": 0.14},
    ],
)
def test_a_camera_of_any_mount_in_the_grasp_or_in_the_object_is_refused(keys):
    with pytest.raises(PlanRejected, match="camera must be outside the object and at least"):
        hand_camera(draw(load_config("simple", keys), 0))


@pytest.mark.parametrize(("mount", "side"), [("finger", 1), ("finger-right", -1)])
@pytest.mark.parametrize("depth_m", [0.03, 0.07])
def test_a_camera_in_a_finger_looks_at_its_pad_from_the_same_distance_whatever_is_held(mount, side, depth_m):
    camera = hand_camera(draw(load_config("simple", {"camera.mount": mount, "object.depth_m": depth_m}), 0))
    pad = np.array([0.0, side * depth_m / 2, 0.1034])
    image = camera.project((pad - camera.position) @ camera.rotation)
    assert image == pytest.approx([camera.width / 2, camera.height / 2, 0.05])
    above = camera.project((pad - [0, 0, 0.01] - camera.position) @ camera.rotation)
    assert above[1] < image[1]


def test_a_camera_on_the_pad_is_refused():
    config = load_config("simple", {"camera.mount": "finger-right", "camera.y_m": 0.04})
    with pytest.raises(ConfigError, match=r"camera\.y_m 0\.04: a finger-right camera must be at least 0\.03 m behind"):
        hand_camera(draw(config, 0))


@pytest.mark.parametrize(
    ("turn", "moves"),
    [({"yaw_deg": 2.0}, (-1, 0)), ({"pitch_deg": 2.0}, (0, 1))],
    ids=["to the right", "up"],
)
def test_a_turn_of_the_camera_moves_the_image_the_other_way(turn, moves):
    still = hand_camera(draw(load_config("simple"), 0))
    turned = hand_camera(draw(load_config("simple", {f"camera.{k}": v for k, v in turn.items()}), 0))
    ahead = still.position - 0.3 * still.rotation[:, 2]
    image = turned.project((ahead - turned.position) @ turned.rotation)[:2]
    expected = np.array(moves) * turned.focal_px * np.tan(np.radians(2)) + [turned.width / 2, turned.height / 2]
    assert image == pytest.approx(expected)


def test_a_roll_clockwise_turns_the_image_anticlockwise():
    params = draw(load_config("simple", {"camera.roll_deg": 10.0, "camera.x_m": 0.01}), 0)
    camera, still = hand_camera(params), hand_camera(draw(load_config("simple"), 0))
    assert camera.position - still.position == pytest.approx([0.01, 0, 0])
    right_of_middle = camera.position + still.rotation @ [0.1, 0, -0.3]
    x, y, _ = camera.project((right_of_middle - camera.position) @ camera.rotation)
    assert x > camera.width / 2
    angle = np.arctan2(camera.height / 2 - y, x - camera.width / 2)
    assert np.degrees(angle) == pytest.approx(10)


def test_jitter_is_drawn_for_each_sample():
    config = load_config("complex", {"camera.x_m": {"min": -0.002, "max": 0.002}, "camera.mount": ["side", "front"]})
    drawn = [draw(config, index) for index in range(20)]
    shifts = [hand_camera(params).position - MOUNTS[params.camera.mount].position_m for params in drawn]
    assert np.abs(shifts).max() <= 0.002
    assert len({round(shift[0], 9) for shift in shifts}) == 20
