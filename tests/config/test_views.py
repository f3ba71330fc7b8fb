"""Two cameras in one configuration."""

import pytest

from evslip.config.loading import config_from_text, dump_config, load_config
from evslip.config.params import Params
from evslip.config.views import camera_names, each_view, one_camera, seen_by
from evslip.draws.draw import draw
from evslip.rendering.camera import hand_camera
from evslip.rendering.geometry.hand import LEFT, RIGHT
from evslip.utils.errors import ConfigError

JITTER = {"min": -0.01, "max": 0.01}
TWO = {"camera.x_m": JITTER, "camera.left": {"mount": "finger", "z_m": JITTER}, "camera.right": {"mount": "front"}}


def two(index: int = 0) -> Params:
    return draw(load_config("complex", TWO), index)


def test_a_camera_has_the_keys_of_its_table_and_otherwise_those_of_the_section():
    params = two()
    left, right = each_view(params)
    assert camera_names(params) == ("left", "right") and camera_names(left) == ()
    assert (left.camera.mount, right.camera.mount) == ("finger", "front")
    assert left.camera.x_m == right.camera.x_m == params.camera.x_m != 0
    assert left.camera.z_m != 0 == right.camera.z_m
    assert seen_by(left, "right") == right and seen_by(left, "left") == left


def test_what_is_drawn_for_one_camera_leaves_all_else_alone():
    alone, both = draw(load_config("complex", {"camera.x_m": JITTER}), 3), two(3)
    plain = both.camera.model_copy(update={"left": None, "right": None})
    assert both.model_copy(update={"camera": plain}) == alone
    assert two(3).camera.left != two(4).camera.left


def test_both_cameras_see_through_the_fingers_that_either_is_in():
    left, right = each_view(two())
    assert hand_camera(left).fingers == hand_camera(right).fingers == (RIGHT,)
    params = draw(load_config("simple", {"camera.left.mount": "finger", "camera.right.mount": "finger-right"}), 0)
    assert [hand_camera(one).fingers for one in each_view(params)] == [(), ()]
    assert hand_camera(draw(load_config("simple"), 0)).fingers == (LEFT, RIGHT)


def test_texts_are_read_back_and_say_nothing_of_what_is_not_there():
    config = load_config("simple", {"camera.left": {}, "camera.right": {"fov_deg": [30.0, 60.0]}})
    assert config_from_text(dump_config(config)) == config
    for params in (draw(config, 1), *each_view(draw(config, 1))):
        assert Params.from_json(params.model_dump_json()) == params
    assert not any(word in dump_config(load_config("simple")) for word in ("left", "right"))
    assert not any(word in draw(load_config("simple"), 0).model_dump_json() for word in ("seen_by", "left", "right"))


@pytest.mark.parametrize(
    ("keys", "error"),
    [
        ({"camera.left": {"mount": "top"}, "camera.right": {}}, r"camera\.left\.mount: 'top' is unknown; .* side"),
        ({"camera.left": {"k1": 3.0}, "camera.right": {}}, r"camera\.left\.k1: 3 is out of range, expected -1 to 1"),
        ({"camera.left": {"fov": 3.0}, "camera.right": {}}, r"camera\.left\.fov: unknown key; did you mean fov_deg"),
        ({"camera.left": {"width": 8}, "camera.right": {}}, r"camera\.left\.width: 8 is out of range"),
        ({"camera.left": {"mount": "front"}}, r"camera\.right: is missing beside left"),
        ({"camera.top": {}}, r"camera\.top: unknown key"),
        ({"camera.left": 3, "camera.right": {}}, r"camera\.left: 3 is wrong: expected a section of keys"),
    ],
)
def test_what_is_wrong_is_named(keys, error):
    with pytest.raises(ConfigError, match=error):
        load_config("simple", keys)


def test_a_camera_has_to_be_chosen():
    with pytest.raises(ConfigError, match="the sample has the cameras left, right, of which one has to be chosen"):
        hand_camera(two())
    with pytest.raises(ConfigError, match="'up' is unknown; the sample has the cameras left, right"):
        seen_by(two(), "up")
    with pytest.raises(ConfigError, match="the sample has one camera, without a name"):
        seen_by(draw(load_config("simple"), 0), "left")
    one_camera(each_view(two())[0])
