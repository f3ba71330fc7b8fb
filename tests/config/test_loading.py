import os

import pytest
from hypothesis import given
from hypothesis import strategies as st

from evslip.config.config import Config
from evslip.config.loading import config_from_text, dump_config, load_config, parse_override
from evslip.config.presets import PRESETS
from evslip.draws.draw import draw
from evslip.utils.errors import ConfigError


@pytest.mark.parametrize("preset", PRESETS)
def test_presets_load_and_survive_a_round_trip_through_toml(preset, tmp_path):
    config = load_config(preset)
    assert config_from_text(dump_config(config)) == config
    path = tmp_path / "mine.toml"
    path.write_text(dump_config(config))
    assert load_config(path) == config


def test_text_of_any_characters_survives_a_round_trip_through_toml():
    for text in ("caf\u00e9", "\U0001f600", "\x7f", 'a"b\\c', "\x01\t"):
        config = load_config("simple", {"object.texture": text})
        assert config_from_text(dump_config(config)).object.texture == text


def test_a_file_states_only_what_differs_from_its_preset(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('preset = "complex"\n[object]\nmass_kg = 0.05\n')
    assert load_config(path) == load_config("complex", {"object.mass_kg": 0.05})


def test_a_range_of_a_preset_is_replaced_whole(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('preset = "complex"\n[object]\nmass_kg = { min = 0.02, max = 0.03 }\n')
    mass = load_config(path).object.mass_kg
    assert (mass.min, mass.max) == (0.02, 0.03)


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("object.mass", 1, ["object.mass:", "unknown key", "mass_kg"]),
        ("objct.mass_kg", 1, ["objct:", "unknown key", "object"]),
        ("object.mass_kg", -1, ["object.mass_kg:", "-1", "0.001 to 2"]),
        ("object.mass_kg", "heavy", ["object.mass_kg:", "'heavy'", "number"]),
        ("object.mass_kg", {"min": 1}, ["object.mass_kg:", "min and max"]),
        ("object.mass_kg", {"min": 2.0, "max": 1.0}, ["object.mass_kg:", "min < max"]),
        ("object.mass_kg", [], ["object.mass_kg:", "at least one"]),
        ("object.mass_kg", [0.1, 99], ["object.mass_kg:", "99", "out of range"]),
        ("object.mass_kg", float("nan"), ["object.mass_kg:", "finite"]),
        ("object", 3, ["object:", "section"]),
        ("object.mass_kg.x", 3, ["object.mass_kg.x:", "unknown key"]),
        ("object.texture", 3, ["object.texture:", "name"]),
        ("camera.mount", "top", ["camera.mount:", "'top'", "side, front, custom, finger, finger-right"]),
        ("camera.width", 1.5, ["camera.width:", "integer"]),
        ("render.max_motion_px", True, ["render.max_motion_px:", "number"]),
        ("sensor.theta", [0.1, 9], ["sensor.theta:", "9", "0.01 to 5"]),
        ("seed", -1, ["seed:", "-1"]),
        ("sampling", "all", ["sampling:", "'grid' or 'random'"]),
    ],
)
def test_a_wrong_value_gives_one_line_that_names_the_key(key, value, words):
    with pytest.raises(ConfigError) as caught:
        load_config("simple", {key: value})
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith("simple: ")
    assert all(word in message for word in words), message


NARROW = {"light.distance_m": {"min": 1.0, "max": 3.0}}
NEAR = {"background.radius_m": 5.0, "passers.count": 1.0}


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        ({"light.radius_m": 1.0, **NARROW}, r"light\.radius_m: 1 is too large, .* light\.distance_m, which may be 1"),
        ({"light.radius_m": [0.1, 1.0], **NARROW}, "which may be 1"),
        (
            {"passers.distance_m": 4.5, **NEAR},
            r"passers\.distance_m: 4\.5 .* background\.radius_m 5; expected at most 3\.8",
        ),
    ],
)
def test_values_that_do_not_fit_together_are_refused_before_a_sample_is_drawn(overrides, words):
    with pytest.raises(ConfigError, match=words):
        load_config("simple", overrides)


def test_values_that_may_fit_together_are_not_refused():
    pairs = {"light.radius_m": [0.5, 2.0], "light.distance_m": [1.0, 3.0]}
    draw(load_config("simple", {**pairs, "together": [list(pairs)]}), 0)
    load_config("simple", {"passers.distance_m": 4.5, **NEAR, "passers.crosses": "light"})


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("object = [", "not valid TOML"),
        ('preset = "hard"', "expected one of demo"),
        ("[object]\nmas_kg = 1", "mass_kg"),
    ],
)
def test_a_wrong_file_gives_one_line_that_names_it(text, words, tmp_path):
    path = tmp_path / "wrong.toml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=words) as caught:
        load_config(path)
    assert str(caught.value).startswith(str(path))


MANY = 100_000
HUGE = {
    "number": ("seed = " + "9" * 400, "seed: a number of over 300 digits is out of range"),
    "thousands of digits": ("seed = " + "9" * 5000, "a number of too many digits"),
    "huge mass": ("[object]\nmass_kg = " + "9" * 400, "object.mass_kg: .*expected a finite number"),
    "huge range": ("[object]\nmass_kg = { min = 1, max = " + "9" * 400 + " }", "object.mass_kg: .*finite number"),
    "huge count": ("[motion]\ncycles = " + "9" * 400, "motion.cycles: a number of over 300 digits"),
    "brackets": ("seed = " + "[" * 50_000, "nested too deep"),
    "tables": ("seed = " + "{a=" * 50_000, "nested too deep"),
    "dots": (".".join("a" * 50_000) + " = 1", "a key of more than 50 parts"),
    "numbers": (f"[object]\nmass_kg = {[0.1] * MANY}", "object.mass_kg: .*a list of 100,000 choices; expected at most"),
    "ranges": ("[object]\nmass_kg = [" + "{min=.1,max=.2}," * MANY + "]", "a list of 100,000 choices|not valid TOML"),
    "names": (f"[object]\nshape = {['cuboid'] * MANY}", "object.shape: .*a list of 100,000 choices"),
    "size": ("# " + "x" * 5_000_000, "larger than 4 MB"),
}


@pytest.mark.parametrize("name", HUGE)
def test_whatever_its_size_one_line_says_what_is_wrong(name: str, tmp_path):
    text, words = HUGE[name]
    (tmp_path / "huge.toml").write_text(text)
    with pytest.raises(ConfigError, match=words) as caught:
        load_config(tmp_path / "huge.toml")
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 500


@pytest.mark.parametrize("value", ["9" * 5000, "[" * 50_000, "{a=" * 50_000])
def test_an_override_of_any_size_is_no_more_than_wrong(value: str):
    with pytest.raises(ConfigError, match="seed: "):
        load_config("demo", dict([parse_override(f"seed={value}")]))


def test_devices_and_pipes_are_no_configurations(tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    for path in ("/dev/zero", tmp_path / "pipe.toml"):
        with pytest.raises(ConfigError, match=r"cannot be read as a TOML file: .* is a device, a pipe or a socket"):
            load_config(path)


def test_an_empty_file_changes_nothing(tmp_path):
    (tmp_path / "empty.toml").touch()
    assert load_config(tmp_path / "empty.toml") == load_config("simple")


def test_files_that_are_none(tmp_path):
    with pytest.raises(ConfigError, match="neither a preset"):
        load_config(tmp_path / "absent.toml")
    with pytest.raises(ConfigError, match="cannot be read"):
        load_config(tmp_path)
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ConfigError, match="cannot be read"):
        load_config(tmp_path / "binary.toml")


def test_overrides_from_the_command_line_are_toml_or_bare_words():
    assert parse_override("object.mass_kg=0.05") == ("object.mass_kg", 0.05)
    assert parse_override("object.mass_kg={min=0.01, max=0.02}") == ("object.mass_kg", {"min": 0.01, "max": 0.02})
    assert parse_override("camera.mount=front") == ("camera.mount", "front")
    with pytest.raises(ConfigError, match="KEY=VALUE"):
        parse_override("object.mass_kg")


json_like = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=4), inner, max_size=3),
    max_leaves=6,
)
SECTIONS = ("object", "light", "camera", "sensor", "render")
NAMES = ("texture", "mass_kg", "width", "theta", "polar_deg", "mount", "max_motion_px")
keys = st.sampled_from([f"{s}.{n}" for s in SECTIONS for n in NAMES] + ["seed", "sampling", "object", "x"])


@given(keys, json_like)
def test_any_value_at_any_key_loads_or_raises_config_error_in_one_line(key, value):
    try:
        config = load_config("complex", {key: value})
    except ConfigError as error:
        assert "\n" not in str(error) or "\n" in repr(value)
    else:
        assert isinstance(config, Config)
        assert config_from_text(dump_config(config)) == config
