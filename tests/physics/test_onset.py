"""The limit surface and the mass at the onset of slip, against closed forms."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import dblquad

import evslip
from evslip.config.params import Params
from evslip.draws.draw import draw
from evslip.physics.contact import PAD_HALF_M
from evslip.physics.grip import LEFT, contact_elements, grasp
from evslip.physics.limit_surface import LimitSurface
from evslip.physics.onset import load_per_kg, onset_mass, pad_surface
from evslip.physics.scene_model import GRAVITY_M_S2
from evslip.utils.errors import ConfigError, PlanRejected
from pads import contact_patch

AT_REST = {"motion.lift_m": 0.0, "motion.move_y_m": 0.0, "motion.tilt_deg": 0.0, "motion.duration_s": 60.0}
CENTRAL = {"object.width_m": 0.05, "object.height_m": 0.1, "grip.offset": 0.0, "grip.depth_m": 0.02}


def with_values(**overrides) -> Params:
    return draw(evslip.load_config("complex", CENTRAL | overrides), 0)


def test_a_central_grip_at_rest_holds_two_pads_of_friction():
    params = with_values(**AT_REST)
    assert onset_mass(params) == pytest.approx(2 * 0.5 * 1.0 / GRAVITY_M_S2, rel=2e-3)


def test_a_square_patch_resists_torsion_as_its_integral_says():
    surface = pad_surface(with_values())
    distance = dblquad(lambda x, z: np.hypot(x, z), -PAD_HALF_M, PAD_HALF_M, -PAD_HALF_M, PAD_HALF_M)[0]
    torque_n_m = distance / (2 * PAD_HALF_M) ** 2
    assert surface.utilisation(np.array([0, 0, torque_n_m])) == pytest.approx(1, rel=2e-3)


def test_a_force_beside_the_patch_slips_about_the_centre_that_yields_first():
    # Brute force over centres of rotation on the line through the patch, for a weight that hangs beside it.
    params = with_values()
    points, weights = contact_elements(params)
    for arm in (0.002, 0.01, 0.03):
        centres = np.r_[-np.geomspace(1e-5, 5, 4000), np.linspace(0, 0.999 * arm, 2000)]
        distance = np.hypot(points[:, 0] - centres[:, None], points[:, 1]) @ weights
        carried = np.min(distance / np.abs(arm - centres))
        assert pad_surface(params).utilisation(np.array([0, carried, -arm * carried])) == pytest.approx(1, rel=2e-3)


def test_one_point_carries_force_in_every_direction_and_torque_only_by_its_lever():
    surface = LimitSurface.of(np.array([[0.01, -1e-6], [0.01, 1e-6]]), np.ones(2))
    angles = np.linspace(0, 2 * np.pi, 7)
    wrenches = np.stack([np.cos(angles), np.sin(angles), -0.01 * np.sin(angles)], axis=1)
    assert surface.utilisation(wrenches, 2.0) == pytest.approx(0.5, rel=2e-3)
    assert surface.utilisation(np.array([0, 0, 1e-3])) == pytest.approx(1000)


def test_the_models_points_carry_what_the_even_pressure_does():
    for overrides in ({}, {"grip.depth_m": -0.006}, {"grip.offset": 0.8, "object.width_m": 0.03}):
        params = with_values(**overrides)
        points = grasp(params).pads[LEFT].contacts
        model = LimitSurface.of(points, np.ones(len(points)))
        directions = np.random.default_rng(0).normal(size=(500, 3)) * [1, 1, 0.006]
        ratio = model.utilisation(directions) / pad_surface(params).utilisation(directions)
        assert 0.96 < ratio.min() <= ratio.max() < 1.045


def test_elements_share_the_force_and_centre_on_the_patch():
    params = with_values(**{"grip.depth_m": -0.003})
    points, weights = contact_elements(params)
    x0, x1, z0, z1 = contact_patch(params)
    assert weights.sum() == pytest.approx(1)
    assert weights @ points == pytest.approx([(x0 + x1) / 2, (z0 + z1) / 2])
    assert weights @ (points[:, 0] - (x0 + x1) / 2) ** 2 == pytest.approx((x1 - x0) ** 2 / 12)


def test_a_motion_that_is_too_long_is_refused_before_its_load_is_looked_at():
    params = with_values(**{"motion.kind": "rotate"})
    long = params.model_copy(update={"motion": params.motion.model_copy(update={"cycles": 1000})})
    with pytest.raises(PlanRejected, match=r"rotate takes .* expected at most 1,000"):
        onset_mass(long)


def test_the_load_at_rest_is_gravity_at_its_lever():
    params = with_values(**AT_REST, **{"grip.offset": 0.5})
    arm = -0.9 * 0.025 * 0.5
    expected = [0, GRAVITY_M_S2, -arm * GRAVITY_M_S2]
    assert load_per_kg(params, np.array([30.0]))[0] == pytest.approx(expected, abs=1e-6)


def test_the_load_of_an_upright_lift_is_the_second_derivative_of_its_height():
    params = with_values(**{"motion.move_y_m": 0.0, "motion.tilt_deg": 0.0})
    peak = 10 * np.sqrt(3) / 3 * params.motion.lift_m / 0.8**2
    load = load_per_kg(params, np.linspace(0.95, 1.75, 4001))
    assert load[:, 1].max() - GRAVITY_M_S2 == pytest.approx(peak, rel=5e-3)


offsets, depths = st.floats(-0.9, 0.9), st.floats(-0.004, 0.02)


@settings(max_examples=15)
@given(offset=offsets, depth=depths, factor=st.floats(1.1, 3.0))
def test_onset_is_proportional_to_force_and_friction(offset, depth, factor):
    grip = {"grip.offset": offset, "grip.depth_m": depth}
    reference = onset_mass(with_values(**grip))
    assert onset_mass(with_values(**grip, **{"grip.force_n": factor})) == pytest.approx(factor * reference)
    assert onset_mass(with_values(**grip, **{"grip.friction": 0.5 * factor})) == pytest.approx(factor * reference)


@settings(max_examples=15)
@given(offset=offsets, depth=depths, tilt=st.floats(-40, 40))
def test_mirroring_grip_and_tilt_leaves_the_onset_alone(offset, depth, tilt):
    one = with_values(**{"grip.offset": offset, "grip.depth_m": depth, "motion.tilt_deg": tilt})
    other = with_values(**{"grip.offset": -offset, "grip.depth_m": depth, "motion.tilt_deg": -tilt})
    assert onset_mass(one) == pytest.approx(onset_mass(other), rel=2e-3)


@settings(max_examples=15)
@given(scale=st.floats(0.3, 3.0), seed=st.integers(0, 1000))
def test_a_patch_twice_as_large_carries_twice_the_torque(scale, seed):
    rng = np.random.default_rng(seed)
    points, weights = rng.normal(size=(20, 2)) * 0.01, rng.uniform(0.1, 1, 20)
    wrenches = rng.normal(size=(50, 3)) * [1, 1, 0.01]
    small = LimitSurface.of(points, weights).utilisation(wrenches)
    large = LimitSurface.of(scale * points, weights).utilisation(wrenches * [1, 1, scale])
    assert large == pytest.approx(small)


def test_the_whole_motion_slips_with_its_hardest_phase():
    params = with_values(**{"grip.offset": 0.5})
    phases = [onset_mass(params, [name]) for name in ("lift", "tilt", "back", "placement")]
    assert onset_mass(params) == min(phases)


@pytest.mark.parametrize("phases", [["approach"], ["lift", "tlit"], []])
def test_phases_without_a_load_are_an_error(phases):
    with pytest.raises(ConfigError, match="expected some of lift, tilt, back, placement"):
        onset_mass(with_values(), phases)
