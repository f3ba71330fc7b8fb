"""The readout in the configuration and in records."""

import json
from dataclasses import fields
from pathlib import Path

import pytest

from evslip.config.loading import config_from_text, dump_config, load_config
from evslip.config.params import Params
from evslip.config.sections.readout import ReadoutSpec
from evslip.data import record_file
from evslip.draws.draw import draw
from evslip.events import PixelModel, Readout, preset_file
from evslip.generation.generate import make_record
from evslip.generation.sensor import camera_for
from evslip.utils.errors import ConfigError

SMALL = {"camera.width": 64, "camera.height": 48, "motion.duration_s": 6.0}
FAULTY = {"readout.frame_us": 200.0, "readout.scan_us": 150.0, "readout.lost_share": 0.1, "readout.jumps_hz": 2.0}


def test_the_section_has_the_parameters_of_the_readout():
    assert list(ReadoutSpec.model_fields) == [field.name for field in fields(Readout)]


def test_a_sample_without_a_readout_is_written_as_before_there_was_one():
    config = load_config("complex")
    params = draw(config, 0)
    assert "readout" not in dump_config(config) and "readout" not in json.loads(params.model_dump_json())
    assert config_from_text(dump_config(config)) == config and Params.from_json(params.model_dump_json()) == params
    assert not camera_for(params).readout.is_on


@pytest.mark.parametrize("frame_us", [100.0, {"min": 100.0, "max": 200.0}, [200.0, 100.0]])
def test_a_scan_that_may_be_longer_than_a_frame_is_refused_before_a_sample_is_drawn(frame_us):
    with pytest.raises(ConfigError, match=r"^simple: readout\.scan_us: 150 takes longer than a frame, .* lets be 100;"):
        load_config("simple", {"readout.frame_us": frame_us, "readout.scan_us": -150.0})


def test_frames_and_scans_that_are_walked_through_together_are_left_to_the_sample():
    load_config("simple", {"readout.frame_us": [100.0, 200.0], "readout.scan_us": [90.0, 150.0]})


def test_a_readout_is_drawn_kept_and_used():
    config = load_config("simple", FAULTY | {"readout.lost_share": {"min": 0.1, "max": 0.2}})
    assert config_from_text(dump_config(config)) == config
    params = draw(config, 3)
    assert Params.from_json(params.model_dump_json()) == params
    readout = camera_for(params).readout
    assert 0.1 <= readout.lost_share <= 0.2 and readout.scan_us == 150.0
    plain = draw(load_config("simple"), 3)
    assert params.model_copy(update={"readout": plain.readout}) == plain, "other draws must not change"


def test_the_configuration_replaces_the_presets_readout(tmp_path: Path):
    path = tmp_path / "own.toml"
    path.write_text(preset_file.text(PixelModel(), {}, readout=Readout(frame_us=300.0, lost_share=0.5)))
    params = draw(load_config("simple", {"sensor.preset": str(path), "readout.lost_share": 0.0}), 0)
    assert camera_for(params).readout == Readout(frame_us=300.0)


def test_a_record_counts_what_the_readout_lost():
    config = load_config("simple", SMALL | FAULTY)
    record = make_record(draw(config, 0))
    clean = make_record(draw(load_config("simple", SMALL), 0))
    stats = record.stats
    assert stats["events_offered"] == clean.events.count and stats["events_read"] == record.events.count
    lost = stats["events_blocked"] + stats["events_overflowed"] + stats["events_dropped"]
    assert stats["events_read"] + lost + stats["events_waiting"] == stats["events_offered"]
    assert stats["events_dropped"] / (stats["events_offered"] - stats["events_blocked"]) == pytest.approx(0.1, abs=0.02)
    assert set(clean.stats) == {"frames"}
    assert record_file.encode(record) == record_file.encode(make_record(draw(config, 0)))
    assert record.truth is not None and clean.truth is not None
    assert (record.truth.theta_deg == clean.truth.theta_deg).all(), "what happened does not depend on who saw it"


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        ({"readout.lost_share": 1.5}, "readout.lost_share: 1.5 is out of range"),
        ({"readout.frame": 1}, "readout.frame: unknown key"),
        ({"readout": 3}, "readout"),
    ],
)
def test_wrong_values_are_named(overrides: dict[str, object], message: str):
    with pytest.raises(ConfigError, match=message) as caught:
        load_config("simple", overrides)
    assert "\n" not in str(caught.value)


def test_a_readout_that_cannot_be_is_named_before_anything_is_made():
    params = draw(load_config("simple", {"readout.frame_us": 100.0, "readout.row_us": 1.0}), 0)
    with pytest.raises(ConfigError, match=r"readout.frame_us: event frames have no arbiter"):
        camera_for(params)
