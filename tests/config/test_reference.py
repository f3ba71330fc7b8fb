from pathlib import Path

from evslip.config.reference import parameters_table
from evslip.config.robot_file import ArmFile, BoxFile, CameraFile, GripperFile, PadsFile, PartFile, RobotFile

PAGE = Path(__file__).resolve().parents[2] / "docs" / "reference" / "parameters.md"


def test_the_documented_parameters_are_those_of_the_schema():
    assert parameters_table() in PAGE.read_text(), "put the output of `evslip show parameters` there"


def test_every_key_of_a_robots_file_is_in_its_page():
    text = (PAGE.parent / "robot-file.md").read_text()
    for section in (RobotFile, ArmFile, GripperFile, PadsFile, PartFile, BoxFile, CameraFile):
        assert all(f"`{key}`" in text or f"{key} = " in text or f"[{key}]" in text for key in section.model_fields)
