"""Slip on purpose: every kind does what its name says."""

import numpy as np
import pytest

import evslip
from evslip.config.params import Params
from evslip.config.sections.slip import SLIP_KINDS
from evslip.draws.provoked_slips import RECIPES
from evslip.physics.motion.servo_plan import tool_path
from evslip.physics.onset import onset_mass
from evslip.physics.truth import Truth
from evslip.utils.errors import ConfigError
from named_slips import shows

MADE = SLIP_KINDS[1:]


def draw(kind: str | list[str], index: int = 0, split: str = "train", **overrides) -> Params:
    values = {key.replace("__", "."): value for key, value in overrides.items()}
    return evslip.draw(evslip.load_config("complex", {"slip.kind": kind, **values}), index, split)


def truth_of(params: Params) -> Truth:
    return evslip.measure(evslip.simulate(params))


@pytest.mark.parametrize("kind", MADE)
def test_a_draw_does_what_its_kind_says(kind):
    params = draw(kind, index=6)
    assert params.slip.kind == kind
    assert shows(kind, truth_of(params))


@pytest.mark.slow
@pytest.mark.parametrize("kind", MADE)
def test_test_draws_do_what_their_kind_says(kind):
    assert [shows(kind, truth_of(draw(kind, index, "test"))) for index in range(2)] == [True, True]


def test_names_are_told_apart():
    truths = {kind: truth_of(draw(kind, index=1)) for kind in ("hold", "translation", "placement", "drop")}
    for kind in truths:
        assert [name for name, truth in truths.items() if shows(kind, truth)] == [kind]


@pytest.mark.parametrize("kind", MADE)
def test_the_mass_is_the_stored_multiple_of_the_onset_over_the_phases(kind):
    for split in ("train", "test"):
        params, recipe = draw(kind, 3, split), RECIPES[kind]
        onset = onset_mass(params, recipe.phases or None)
        assert params.slip.multiple is not None
        assert params.object.mass_kg == pytest.approx(params.slip.multiple * onset)
        assert params.slip.multiple <= recipe.multiple[1]
        if recipe.earlier:
            assert params.object.mass_kg < onset_mass(params, [p for p in recipe.earlier if p != "hold"])


def test_a_multiple_of_ones_own_is_kept():
    for multiple in (0.9, 1.7, [1.1, 1.2], {"min": 1.3, "max": 1.4}):
        drawn = draw("tilt", slip__multiple=multiple).slip.multiple
        assert drawn is not None
        wanted = [multiple] if isinstance(multiple, float) else multiple
        inside = 1.3 <= drawn <= 1.4 if isinstance(wanted, dict) else np.isclose(drawn, wanted).any()
        assert inside


def test_what_fits_a_recipe_is_kept_and_what_does_not_is_replaced():
    kept = draw("tilt", grip__offset=0.05, motion__tilt_deg=22.0)
    assert (kept.grip.offset, kept.motion.tilt_deg) == (0.05, 22.0)
    replaced = draw("tilt", grip__offset=0.7, motion__tilt_deg=5.0)
    assert abs(replaced.grip.offset) <= 0.1
    assert 18 <= abs(replaced.motion.tilt_deg) <= 30


def test_natural_changes_nothing():
    config = evslip.load_config("complex")
    params = evslip.draw(config, 5)
    assert params.slip.kind == "natural" and params.slip.multiple is None
    assert 0.010 <= params.object.mass_kg <= 0.085


def test_a_list_of_kinds_is_drawn_from_in_both_splits_and_leaves_other_keys_alone():
    kinds = ["hold", "rotation", "natural"]
    for split in ("train", "test"):
        drawn = [draw(kinds, index, split) for index in range(30)]
        assert {params.slip.kind for params in drawn} == set(kinds)
        alone = [draw("natural", index, split) for index in range(30)]
        assert [a.object.width_m for a in drawn] == [b.object.width_m for b in alone]


def test_a_recipe_s_values_of_training_and_testing_never_meet():
    offsets = [{draw("tilt", index, split).grip.offset for index in range(9)} for split in ("train", "test")]
    assert not set.intersection(*offsets)


def test_a_draw_is_pure_and_survives_its_json():
    one, again = draw("placement", 4), draw("placement", 4)
    assert one == again == Params.from_json(one.model_dump_json())


def test_parameters_from_before_the_kinds_are_natural():
    text = evslip.draw(evslip.load_config("demo"), 0).model_dump_json(exclude={"slip"})
    assert Params.from_json(text).slip.kind == "natural"


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        ({"slip__kind": "fall"}, "slip.kind: 'fall' is unknown; expected one of natural, hold"),
        ({"slip__kind": ["tilt", "fall"]}, "slip.kind: 'fall' is unknown"),
        ({"slip__kind": "natural", "slip__multiple": 1.0}, "slip.multiple: needs a slip.kind"),
        ({"slip__kind": "tilt", "motion__kind": "shake"}, "slip.kind: 'tilt' needs motion.kind pick_and_place"),
        ({"slip__kind": "lift", "grip__force_n": 70.0, "grip__friction": 2.0}, "slip.kind: 'lift' needs a mass of"),
    ],
)
def test_what_cannot_be_is_said_in_one_line(overrides, words):
    kind = overrides.pop("slip__kind")
    with pytest.raises(ConfigError, match=words):
        draw(kind, **overrides)


def test_friction_carries_the_weight_and_is_used_up_where_it_slips():
    params = draw("lift", 2)
    trajectory = evslip.simulate(params)
    truth = evslip.measure(trajectory)
    assert trajectory.pad_friction is not None and trajectory.pad_utilisation is not None
    still = truth.held & (truth.t_us > 1_800_000) & truth.during("lift")  # lifted, before the tilt
    weight = params.object.mass_kg * 9.81
    assert trajectory.pad_friction[still].sum(axis=1)[:, 1] == pytest.approx(weight, rel=0.02)
    tool, _ = tool_path(params, trajectory.t_us[still] / 1e6)
    torque = -weight * (trajectory.object_pose[still, 0] - tool[:, 0])
    assert trajectory.pad_friction[still].sum(axis=1)[:, 2] == pytest.approx(torque, abs=0.0005 * weight)
    slip = truth.episodes[0]
    sliding = (truth.t_us > slip.start_us + 30_000) & (truth.angular_speed_deg_s > 5) & truth.held
    assert sliding.sum() > 30
    assert np.median(trajectory.pad_utilisation[sliding]) == pytest.approx(1, abs=0.03)
    assert trajectory.pad_utilisation[truth.held].max() < 1.05
    open_hand = truth.t_us < 400_000
    assert not trajectory.pad_utilisation[open_hand].any()


@pytest.mark.parametrize("multiple", [0.3, 0.6])
def test_utilisation_of_a_held_object_is_near_its_share_of_the_onset(multiple):
    params = draw("hold", 0, slip__multiple=multiple, grip__offset=0.5, motion__tilt_deg=25.0)
    trajectory = evslip.simulate(params)
    held = evslip.measure(trajectory).held
    assert trajectory.pad_utilisation is not None
    assert trajectory.pad_utilisation[held].max() == pytest.approx(multiple, rel=0.03)
