from pathlib import Path

from evslip.config.reference import parameters_table

PAGE = Path(__file__).resolve().parents[2] / "docs" / "reference" / "parameters.md"


def test_the_documented_parameters_are_those_of_the_schema():
    assert parameters_table() in PAGE.read_text(), "put the output of `evslip show parameters` there"
