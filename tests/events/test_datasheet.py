from pathlib import Path

import numpy as np
import pytest

from evslip.codecs import read_events
from evslip.events.datasheet import UNITS, datasheet, meanings, presets_table
from evslip.events.pixel_model import LIMITS, PARAMETERS
from evslip.events.presets import PRESETS, READOUTS, named_readout
from evslip.events.readout.settings import READOUT_PARAMETERS, Readout
from evslip.utils.errors import ConfigError
from shared_data import shared

PAGE = Path(__file__).resolve().parents[2] / "docs" / "reference" / "cameras.md"


def test_every_parameter_has_a_meaning_a_unit_and_limits():
    assert tuple(meanings()) == tuple(UNITS) == tuple(LIMITS) == PARAMETERS
    assert all(text.endswith(".") for text in meanings().values())


@pytest.mark.parametrize("preset", PRESETS)
def test_a_datasheet_names_every_parameter(preset):
    firsts = [line.split()[0] for line in datasheet(preset).splitlines() if not line.startswith(" ")]
    assert firsts == ["parameter", *PARAMETERS]


def test_a_readouts_sheet_names_every_parameter():
    assert tuple(meanings(Readout)) == READOUT_PARAMETERS
    for preset in PRESETS:
        lines = datasheet(named_readout(preset)).splitlines()
        assert [line.split()[0] for line in lines if not line.startswith(" ")] == ["parameter", *READOUT_PARAMETERS]
    assert set(READOUTS) <= set(PRESETS)


def test_an_unknown_preset_is_refused():
    with pytest.raises(ConfigError, match="davis346, davis346-bright"):
        datasheet("davis")


def test_the_documented_presets_are_those_of_the_code():
    assert presets_table() in PAGE.read_text(), "put the output of `evslip show camera` there"


def test_a_dvxplorers_pixels_rest_as_long_as_its_preset_says():
    events = read_events(shared("real", "dvxplorer.aedat4"))
    pixel = events.y.astype(np.int64) * 1024 + events.x
    order = np.lexsort((events.t_us, pixel))
    gaps = np.diff(events.t_us[order])[np.diff(pixel[order]) == 0]
    assert gaps.min() == pytest.approx(PRESETS["dvxplorer"].refractory_us, rel=0.02)
    # The sensor is read out frame by frame.
    frame_us = 197.5
    assert np.abs(gaps[gaps < 2000] - frame_us * np.round(gaps[gaps < 2000] / frame_us)).max() < 0.06 * frame_us


def test_a_dvxplorer_lites_columns_share_time_stamps_as_its_readout_says():
    events, readout = read_events(shared("real", "dvxplorer.aedat4")), READOUTS["dvxplorer-lite"]
    t_us, x = (events.t_us - events.t_us[0]).astype(float), events.x.astype(int)
    phase = np.exp(2j * np.pi * (t_us - readout.scan_us * x / 320) / readout.frame_us)
    assert np.abs(phase.mean()) > 0.99
    frame = np.round((t_us - readout.scan_us * x / 320) / readout.frame_us - np.angle(phase.mean()) / (2 * np.pi))
    column = frame.astype(int) * 320 + x
    assert len(np.unique(column)) == len(np.unique(column * 2**20 + events.t_us - events.t_us[0]))
    assert len(np.unique(column * 240 + events.y)) == events.count
