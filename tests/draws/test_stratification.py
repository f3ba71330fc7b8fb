import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evslip.config.distributions import extremes
from evslip.config.loading import load_config
from evslip.draws.draw import draw, grid_size, sure_masses
from evslip.draws.stratification import BLOCK, SURE_HOLD, SURE_SLIP, shall_slip
from evslip.physics.onset import onset_mass
from evslip.utils.errors import ConfigError


@given(st.floats(0, 1), st.integers(0, 50), st.integers(1, 30), st.sampled_from(["train", "test"]))
@settings(max_examples=50)
def test_the_wanted_share_slips_in_every_block(fraction, seed, blocks, split):
    config = load_config("complex", {"slip_fraction": fraction, "seed": seed})
    slips = [bool(shall_slip(config, index, split)) for index in range(blocks * BLOCK)]
    assert sum(slips) == int(blocks * BLOCK * fraction + 0.5)
    assert all(abs(sum(slips[:n]) - n * fraction) <= BLOCK for n in range(len(slips)))


def test_slip_does_not_follow_the_order_of_the_grid():
    config = load_config("simple", {"slip_fraction": 0.5})
    slips = np.array([shall_slip(config, index, "train") for index in range(192)])
    for period in (2, 3, 4, 6, 8):
        shares = [slips[start::period].mean() for start in range(period)]
        assert min(shares) > 0.25 and max(shares) < 0.75


def test_each_sample_is_clear_of_its_own_onset():
    config = load_config("complex", {"slip_fraction": 0.3})
    for index in range(2 * BLOCK):
        params = draw(config, index)
        multiple = params.object.mass_kg / onset_mass(params)
        if shall_slip(config, index, "train"):
            assert multiple >= SURE_SLIP * (1 - 1e-9)
        else:
            assert 0.4 * SURE_HOLD < multiple <= SURE_HOLD * (1 + 1e-9) or params.object.mass_kg >= 0.01
    plain = load_config("complex")
    assert all(draw(config, i).grip == draw(plain, i).grip for i in range(5)), "only the mass is chosen"


def test_the_mass_stays_in_its_range_where_that_can_be():
    config = load_config("complex", {"slip_fraction": 0.5, "object.mass_kg": {"min": 0.001, "max": 0.5}})
    masses = [draw(config, index).object.mass_kg for index in range(BLOCK)]
    assert min(masses) >= 0.001 and max(masses) <= 0.5
    assert len(set(masses)) == BLOCK


def test_kinds_are_chosen_by_the_wanted_share():
    config = load_config("complex", {"slip_fraction": 0.25, "slip.kind": ["hold", "rotation", "lift"]})
    kinds = [draw(config, index).slip.kind for index in range(BLOCK)]
    assert kinds.count("hold") == 0.75 * BLOCK
    assert {"rotation", "lift"} >= set(kinds) - {"hold"}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"slip.kind": "rotation"}, "natural"),
        ({"slip.kind": ["rotation", "lift"]}, "hold"),
        ({"object.density_kg_m3": 500.0}, "density_kg_m3"),
        ({"slip_fraction": 1.5}, "1.5"),
    ],
)
def test_what_contradicts_the_wanted_share_is_refused(changes, words):
    with pytest.raises(ConfigError, match=words):
        load_config("complex", {"slip_fraction": 0.5, **changes})


def test_a_mass_beyond_the_limits_is_refused_at_the_draw():
    config = load_config("complex", {"slip_fraction": 1.0, "grip.force_n": 70.0, "grip.friction": 2.0})
    with pytest.raises(ConfigError, match=r"slip_fraction.*kg.*grip\.force_n"):
        draw(config, 0)


def test_in_the_simple_set_the_light_object_never_slips_and_the_heavy_one_always():
    config = load_config("simple")
    low, high, hold, slip = sure_masses(config, grid_size(config))
    assert low < high
    light, heavy = extremes(config.object.mass_kg)
    assert light <= hold and heavy >= slip
    assert light > 0.95 * hold and heavy < 1.05 * slip, "and they are no farther apart than that takes"
