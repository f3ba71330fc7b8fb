from pathlib import Path

import pytest

from evslip.errors import ConfigError
from evslip.events.datasheet import UNITS, datasheet, meanings, presets_table
from evslip.events.presets import LIMITS, PARAMETERS, PRESETS

PAGE = Path(__file__).resolve().parents[1] / "docs" / "event-camera.md"


def test_every_parameter_has_a_meaning_a_unit_and_limits():
    assert tuple(meanings()) == tuple(UNITS) == tuple(LIMITS) == PARAMETERS
    assert all(text.endswith(".") for text in meanings().values())


@pytest.mark.parametrize("preset", PRESETS)
def test_a_datasheet_names_every_parameter(preset):
    firsts = [line.split()[0] for line in datasheet(preset).splitlines() if not line.startswith(" ")]
    assert firsts == ["parameter", *PARAMETERS]


def test_an_unknown_preset_is_refused():
    with pytest.raises(ConfigError, match="davis346, dvxplorer"):
        datasheet("davis")


def test_the_documented_presets_are_those_of_the_code():
    assert presets_table() in PAGE.read_text(), "put the output of `evslip show camera` into docs/event-camera.md"
