from pathlib import Path

import numpy as np
import pytest

from evslip.codecs import read_events
from evslip.events.datasheet import UNITS, datasheet, meanings, presets_table
from evslip.events.pixel_model import LIMITS, PARAMETERS
from evslip.events.presets import PRESETS
from evslip.utils.errors import ConfigError
from shared_data import shared

PAGE = Path(__file__).resolve().parents[2] / "docs" / "explanation" / "event-camera.md"


def test_every_parameter_has_a_meaning_a_unit_and_limits():
    assert tuple(meanings()) == tuple(UNITS) == tuple(LIMITS) == PARAMETERS
    assert all(text.endswith(".") for text in meanings().values())


@pytest.mark.parametrize("preset", PRESETS)
def test_a_datasheet_names_every_parameter(preset):
    firsts = [line.split()[0] for line in datasheet(preset).splitlines() if not line.startswith(" ")]
    assert firsts == ["parameter", *PARAMETERS]


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
