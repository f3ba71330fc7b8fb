"""The sheet of a robot: what is drawn and what is said of it."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from PIL import Image

from evslip.utils.errors import ConfigError
from evslip.view.robot_sheet import PAD, SIGHT, write_robot_sheet

EXAMPLE = Path(__file__).parents[2] / "examples" / "own_robot" / "robot.toml"


def opened(path: Path) -> np.ndarray:
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"))


def shown(path: Path, colour: str) -> int:
    """Pixels of a colour."""
    pixels = opened(path).astype(int)
    return int((np.abs(pixels - np.round(255 * np.array(to_rgb(colour)))).max(axis=2) < 8).sum())


def test_an_own_robot_is_drawn_with_pads_and_camera_and_its_limits_and_assumptions_are_told(tmp_path):
    text = write_robot_sheet(tmp_path / "own.png", str(EXAMPLE))
    assert opened(tmp_path / "own.png").shape == (960, 1600, 3)
    assert shown(tmp_path / "own.png", PAD) > 500 and shown(tmp_path / "own.png", SIGHT) > 500
    assert "elbow: -155 to 155 deg, rest 97, 172 deg/s, 860 deg/s2, 60 N m" in text
    assert "fingers unlike, opens to 80 mm, 0.5 to 40 N, 150 mm from mount to tool centre" in text
    assert "pads     16 x 16 mm" in text and "friction with objects 0.2 to 1" in text
    assert "camera   mount robot: at (0.100, 0.220, -0.030) m" in text and "missing" not in text
    assert "assumed  arm: acceleration_deg_s2 is not given" in text


def test_a_hand_without_an_arm_is_drawn_alone_and_its_camera_is_missed(tmp_path):
    text = write_robot_sheet(tmp_path / "hand.png", "cartesian")
    assert opened(tmp_path / "hand.png").shape == (500, 1600, 3)
    assert "arm      none" in text and "missing  [camera] place_m" in text


def test_a_wrong_name_or_picture_is_one_line(tmp_path):
    with pytest.raises(ConfigError, match=r"robot\.kind: 'ur6' is unknown"):
        write_robot_sheet(tmp_path / "x.png", "ur6")
    with pytest.raises(ConfigError, match=r"out: .* expected \.png"):
        write_robot_sheet(tmp_path / "x.svg", "ur5")
