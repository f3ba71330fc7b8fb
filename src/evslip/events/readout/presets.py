"""Readouts of presets, by the preset's name or of its file."""

from evslip.events import preset_file
from evslip.events.readout.settings import OFF, Readout

READOUTS: dict[str, Readout] = {"dvxplorer-lite": Readout(frame_us=197.28, scan_us=-192.0)}
"""Readouts of the presets of `events.presets` that have one. dvxplorer-lite: measured in a recording of a DVXplorer
Lite (320 x 240 pixels) by `benchmarks/readout.py recording`; other settings of its clock give other frames."""


def named_readout(preset: str) -> Readout:
    """The readout of a preset, off if it has none. Raises ConfigError."""
    return preset_file.read_readout(preset) if preset.endswith(preset_file.SUFFIX) else READOUTS.get(preset, OFF)
