"""Sections that came later: a configuration that does not use them is what it was."""

import json

import pytest

from evslip.config.loading import config_from_text, dump_config, load_config
from evslip.config.params import Params
from evslip.config.sample import OPTIONAL
from evslip.draws.draw import draw
from evslip.draws.separation import separate
from evslip.utils.errors import ConfigError

USED = {
    "clutter": {"count": {"min": 1.0, "max": 5.0}, "shape": ["cuboid", "any"], "texture": "wood-*"},
    "passers": {"count": 2, "crosses": ["background", "light"], "texture": "weave-*"},
    "flicker": {"lamp_depth": {"min": 0.1, "max": 0.3}, "waveform": ["sine", "pwm"], "frequency_hz": [100.0, 120.0]},
    "lens": {"spots": {"min": 1.0, "max": 9.0}, "glare": 0.1},
    "readout": {"lost_share": 0.1},
    "disturbance": {"kind": ["none", "push", "wet"], "push_n": {"min": 0.5, "max": 5.0}, "at": 0.3},
}


@pytest.mark.parametrize("name", OPTIONAL)
def test_a_section_is_written_only_where_it_says_something(name: str):
    plain = load_config("complex")
    assert f"[{name}]" not in dump_config(plain) and name not in json.loads(draw(plain, 0).model_dump_json())
    assert config_from_text(dump_config(plain)) == plain


LATER = {
    "grip.actuator": ["ideal", "panda", "fast"],
    "grip.actuator_delay_s": {"min": 0.0, "max": 0.05},
    "object.finish": ["film", "texture", "metal"],
    "object.roughness": {"min": 0.2, "max": 0.6},
    "render.denoise": True,
}
"""Keys that came later, in sections that are always written."""


@pytest.mark.parametrize("key", sorted(LATER))
def test_a_key_that_came_later_is_written_only_where_it_says_something(key: str):
    section, name = key.split(".")
    plain, used = load_config("complex"), load_config("complex", {key: LATER[key]})
    assert f"\n{name} = " not in dump_config(plain) and f"\n{name} = " in dump_config(used)
    assert config_from_text(dump_config(used)) == used
    drawn = [draw(used, index) for index in range(6)]
    for index, params in enumerate(drawn):
        assert Params.from_json(params.model_dump_json()) == params
        same = {name: getattr(getattr(draw(plain, index), section), name)}
        own = getattr(params, section).model_copy(update=same)
        assert params.model_copy(update={section: own}) == draw(plain, index)
        written = json.loads(params.model_dump_json())[section]
        assert (name in written) == (getattr(getattr(params, section), name) != same[name])


@pytest.mark.parametrize("name", sorted(USED))
def test_a_section_is_drawn_and_read_back_and_changes_no_other_draw(name: str):
    config = load_config("complex", {f"{name}.{key}": value for key, value in USED[name].items()})
    assert config_from_text(dump_config(config)) == config
    params, plain = draw(config, 3), draw(load_config("complex"), 3)
    assert Params.from_json(params.model_dump_json()) == params
    assert params != plain
    assert params.model_copy(update={name: getattr(plain, name)}) == plain


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        ({"flicker.lamp_depth": 1.5}, "flicker.lamp_depth: 1.5 is out of range, expected 0 to 1"),
        ({"flicker.surroundings_depth": {"min": -0.1, "max": 0.1}}, "flicker.surroundings_depth: -0.1 is out of range"),
        ({"flicker.waveform": "square"}, "flicker.waveform: 'square' is unknown; expected one of sine, pwm"),
        ({"flicker.frequency_hz": 0}, "flicker.frequency_hz: 0 is out of range, expected 10 to 1000"),
        ({"flicker.harmonic": 0.5}, "flicker.harmonic: 0.5 is out of range"),
        ({"flicker.duty": 1.0}, "flicker.duty: 1 is out of range"),
        ({"flicker.depth": 0.1}, "flicker.depth: unknown key; did you mean lamp_depth?"),
        ({"flicker": 3}, "flicker: 3 is wrong"),
        ({"lens.spots": -1}, "lens.spots: -1 is out of range"),
        ({"lens.spot_px": 0}, "lens.spot_px: 0 is out of range"),
        ({"lens.spot_opacity": "dark"}, "lens.spot_opacity: 'dark' is wrong"),
        (
            {"object.finish": "shiny"},
            "object.finish: 'shiny' is unknown; expected one of texture, matt, plastic, film, metal",
        ),
        ({"object.finish": ["film", 3]}, "object.finish: ['film', 3] is wrong: expected a name or a list of names"),
        ({"object.roughness": 0}, "object.roughness: 0 is out of range, expected 0.1 to 1"),
        ({"disturbance.kind": "rain"}, "disturbance.kind: 'rain' is unknown; expected one of none, mass, push, wet"),
        ({"disturbance.wet_factor": 0.0}, "disturbance.wet_factor: 0 is out of range, expected 0.05 to 1"),
        ({"disturbance.at": {"min": 0.5, "max": 1.5}}, "disturbance.at: 1.5 is out of range, expected 0 to 1"),
        ({"grip.actuator": "quick"}, "grip.actuator: 'quick' is unknown; expected one of ideal, panda, fast"),
        ({"grip.actuator_delay_s": -1.0}, "grip.actuator_delay_s: -1 is out of range, expected 0 to 0.5"),
        ({"grip.least_n": 30.0}, "grip.least_n: may be 30, which is above grip.most_n 20"),
        ({"lens.glare": 0.9}, "lens.glare: 0.9 is out of range, expected 0 to 0.5"),
    ],
)
def test_wrong_values_are_named(overrides: dict[str, object], message: str):
    with pytest.raises(ConfigError) as caught:
        load_config("simple", overrides)
    assert message in str(caught.value) and "\n" not in str(caught.value)


def test_a_share_of_the_samples_has_a_nuisance_and_draws_it_as_all_would():
    keys = {"flicker.lamp_depth": {"min": 0.1, "max": 0.3}, "lens.glare": 0.1}
    everywhere, some = load_config("complex", keys), load_config("complex", {**keys, "share.flicker": 0.3})
    assert config_from_text(dump_config(some)) == some
    assert "[share]" not in dump_config(everywhere)
    drawn, all_drawn = ([draw(config, index) for index in range(200)] for config in (some, everywhere))
    have = [not params.flicker.is_default for params in drawn]
    assert 40 <= sum(have) <= 80
    for own, other, has in zip(drawn, all_drawn, have, strict=True):
        assert own.lens == other.lens
        assert own == (other if has else other.model_copy(update={"flicker": draw(load_config("complex"), 0).flicker}))


def test_a_share_leaves_the_splits_apart():
    config = load_config("complex", {"lens.spots": {"min": 1.0, "max": 9.0}, "share.lens": 0.5})
    separation = separate(config, {"train": 40, "test": 20})
    assert not separation.shared()
    assert 8 <= len(separation.values["lens.spots"]["train"]) <= 32


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("share.flicker", 1.5, "share.flicker: 1.5 is out of range, expected 0 to 1"),
        ("share.light", 0.5, "share.light: unknown key"),
        ("share.lens", {"min": 0.0, "max": 1.0}, "share.lens"),
    ],
)
def test_a_wrong_share_is_told(key, value, message):
    with pytest.raises(ConfigError, match=message):
        load_config("complex", {key: value})
