import itertools
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import kstest

from evslip.config.distributions import Uniform, extremes
from evslip.config.loading import dump_config, load_config
from evslip.config.params import Params
from evslip.config.sample import leaves
from evslip.config.views import seen_by
from evslip.draws.draw import draw, grid_size
from evslip.physics.simulation import simulate
from evslip.utils.errors import ConfigError

TWO = {"camera.left": {"mount": "front"}, "camera.right": {}}


def test_a_draw_depends_on_configuration_split_and_index_alone():
    config = load_config("complex")
    assert draw(config, 7) == draw(load_config("complex"), 7)
    assert draw(config, 7) != draw(config, 8)
    assert draw(config, 7) != draw(config, 7, "test")
    assert draw(config, 7) != draw(load_config("complex", {"seed": 1}), 7)


@pytest.mark.parametrize("preset", ["simple", "complex", "wild", "hold"])
def test_configurations_and_draws_can_be_pickled(preset):
    config = load_config(preset)
    copied = pickle.loads(pickle.dumps(config))
    assert copied == config and dump_config(copied) == dump_config(config)
    for params in (draw(config, 7), seen_by(draw(load_config(preset, TWO), 7), "left")):
        again = pickle.loads(pickle.dumps(params))
        assert again == params and again.model_dump_json() == params.model_dump_json()


def test_what_is_no_configuration_is_refused():
    with pytest.raises(ConfigError, match="config: str, expected a Config; load_config makes one"):
        draw("demo", 0)  # pyright: ignore[reportArgumentType]
    with pytest.raises(ConfigError, match="params: Config, expected Params, as draw gives them"):
        simulate(load_config("demo"))  # pyright: ignore[reportArgumentType]


def test_changing_one_distribution_leaves_the_other_values_alone():
    before = leaves(draw(load_config("complex"), 3))
    after = leaves(draw(load_config("complex", {"object.width_m": {"min": 0.02, "max": 0.03}}), 3))
    assert {key for key in before if before[key] != after[key]} == {"object.width_m"}


@given(st.integers(0, 10**9))
@settings(max_examples=25)
def test_draws_stay_within_their_ranges(index):
    config = load_config("complex")
    params = draw(config, index)
    for key, value in leaves(params).items():
        section, name = key.split(".")
        spec = getattr(getattr(config, section), name)
        if isinstance(spec, Uniform):
            low, high = extremes(spec)
            assert low <= value <= high


def test_train_and_test_share_no_drawn_value():
    config = load_config("complex", {"grip.force_n": [0.8, 0.9, 1.0, 1.1, 1.2]})
    drawn = {split: [leaves(draw(config, i, split)) for i in range(150)] for split in ("train", "test")}
    varied = [key for key in drawn["train"][0] if len({d[key] for d in drawn["train"]}) > 1]
    assert "object.mass_kg" in varied
    assert "grip.force_n" in varied
    for key in varied:
        assert not {d[key] for d in drawn["train"]} & {d[key] for d in drawn["test"]}, key


def test_a_test_texture_occurs_nowhere_in_training():
    config = load_config("complex")
    seen = {}
    for split in ("train", "test"):
        drawn = [draw(config, i, split) for i in range(200)]
        seen[split] = {part.texture for p in drawn for part in (p.object, p.surface, p.background)}
    assert not seen["train"] & seen["test"]
    assert len(seen["test"]) >= 5


def test_a_grid_visits_every_combination_once():
    config = load_config("simple")
    assert grid_size(config) == 192
    given = leaves(config)
    together = config.together[0]
    alone = [key for key, value in given.items() if isinstance(value, tuple) and key not in together]
    sets = list(zip(*(given[key] for key in together), strict=True))
    drawn = [leaves(draw(config, i)) for i in range(192)]
    seen = {(*(d[key] for key in alone), tuple(d[key] for key in together)) for d in drawn}
    assert seen == set(itertools.product(*(given[key] for key in alone), sets))


def test_the_simple_set_varies_what_the_paper_varied():
    config = load_config("simple")
    sizes = {key: len(value) for key, value in leaves(config).items() if isinstance(value, tuple)}
    assert sizes.pop("grip.offset") == 3
    assert set(sizes.values()) == {2}
    sides, parts = ("width_m", "height_m", "mass_kg"), ("object", "surface", "background")
    paper = {"grip.depth_m", "light.azimuth_deg", *(f"object.{side}" for side in sides)}
    assert set(sizes) == paper | {f"{part}.texture" for part in parts}
    scenes = {
        (p.object.texture, p.surface.texture, p.background.texture) for p in (draw(config, i) for i in range(192))
    }
    assert len(scenes) == 2, "two sets of textures, not all mixtures"
    assert all(len({scene[k] for scene in scenes}) == 2 for k in range(3))


def test_half_of_the_demo_is_heavy():
    config = load_config("demo")
    for split in ("train", "test"):
        heavy = [draw(config, i, split).object.mass_kg > 0.05 for i in range(8)]
        assert heavy == [False, True] * 4


def test_what_cannot_be_drawn_is_refused():
    simple, complex_ = load_config("simple"), load_config("complex")
    with pytest.raises(ConfigError, match="test_share"):
        draw(simple, 0, "test")
    with pytest.raises(ConfigError, match="split"):
        draw(complex_, 0, "validation")
    with pytest.raises(ConfigError, match="index"):
        draw(complex_, -1)
    with pytest.raises(ConfigError, match=r"grip\.force_n: too few"):
        draw(load_config("complex", {"grip.force_n": [1.0]}), 0)


def test_params_survive_json():
    params = draw(load_config("complex"), 5)
    assert Params.from_json(params.model_dump_json()) == params


def test_lights_over_a_sphere_are_as_dense_everywhere():
    config = load_config("complex", {"light.polar_deg": {"min": 20.0, "max": 80.0, "law": "sphere"}})
    drawn = np.array([draw(config, i).light.polar_deg for i in range(400)])
    assert 20 <= drawn.min() <= drawn.max() <= 80
    top, bottom = np.cos(np.radians([20, 80]))
    share = (top - np.cos(np.radians(drawn))) / (top - bottom)
    assert kstest(share, "uniform").pvalue > 1e-3


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ({"min": 0.0, "max": 90.0, "law": "cosine"}, "'cosine', is unknown; expected uniform or sphere"),
        ({"min": -10.0, "max": 90.0, "law": "sphere"}, "0 <= min < max <= 180"),
        ({"min": 0.0, "max": 90.0, "lw": "sphere"}, "exactly the keys min and max, and may have law"),
    ],
)
def test_a_wrong_law_of_a_range_is_named(value, words):
    with pytest.raises(ConfigError, match=words):
        load_config("complex", {"light.polar_deg": value})


def test_shapes_and_mounts_may_be_lists():
    config = load_config("complex", {"object.shape": ["cuboid", "cylinder"], "test_share": 0.0})
    drawn = [draw(config, i).object for i in range(30)]
    assert {spec.shape for spec in drawn} == {"cuboid", "cylinder"}
    assert all(spec.width_m == spec.depth_m for spec in drawn if spec.shape == "cylinder")
