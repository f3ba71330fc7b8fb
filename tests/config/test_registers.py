"""Names that the parameters may hold are those of the registers in the rooms above."""

from typing import get_args, get_type_hints

import pytest

from evslip.cli import look
from evslip.cli.options import Split
from evslip.config.loading import load_config
from evslip.config.sections.camera import CAMERAS, CameraSpec, ViewSpec
from evslip.config.sections.render import RendererName
from evslip.config.sections.robot import ROBOTS, GripperName
from evslip.config.sections.slip import NATURAL, SLIP_KINDS
from evslip.draws.provoked_slips import RECIPES
from evslip.physics.robots.catalogue import ARMS, GRIPPERS
from evslip.rendering import RENDERERS, VIEWS
from evslip.utils.errors import ConfigError
from evslip.utils.seeds import SPLITS


def test_one_of_two_cameras_may_have_every_key_otherwise():
    assert (*ViewSpec.model_fields, *CAMERAS) == tuple(CameraSpec.model_fields)


def test_every_name_has_what_it_stands_for():
    assert set(RENDERERS) == set(get_args(RendererName))
    assert set(ARMS) == set(ROBOTS) and set(GRIPPERS) == set(get_args(GripperName))
    assert {NATURAL, *RECIPES} == set(SLIP_KINDS)


@pytest.mark.parametrize(
    ("key", "good"),
    [
        ("motion.kind", "pick_and_place, hold, shake, rotate, waypoints"),
        ("camera.mount", "side, front, custom, finger, finger-right"),
        (
            "sensor.preset",
            "davis346, davis346-bright, davis346-dim, dvxplorer, dvxplorer-lite, prophesee-like, clean, noisy",
        ),
        ("object.shape", "cuboid, cylinder, mesh"),
        ("slip.kind", "natural, hold, rotation"),
    ],
)
def test_a_bad_name_lists_the_good_ones(key, good):
    for value in ("sid", ["sid"]):
        with pytest.raises(ConfigError, match=f"^simple: {key}: 'sid' is unknown; expected one of {good}") as caught:
            load_config("simple", {key: value})
        assert "\n" not in str(caught.value)


def test_the_command_line_offers_what_the_registers_hold() -> None:
    render = get_type_hints(look.render)
    assert set(RENDERERS) == {name for choice in get_args(render["renderer"]) for name in get_args(choice)}
    assert get_args(render["camera"]) == (*VIEWS, *CAMERAS)
    assert get_args(Split) == SPLITS
