"""Detectors that come with the package. The help of the command line names them, so nothing here needs PyTorch."""

from pathlib import Path

FOLDER = Path(__file__).with_name("models")
NAMES = ("default", "default-complex", "default-wild", "default-hold", "default-hold-wild")
