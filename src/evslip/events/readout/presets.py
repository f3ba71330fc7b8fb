"""Readouts of presets, by the preset's name or of its file."""

from evslip.events import preset_file
from evslip.events.readout.settings import OFF, Readout

READOUTS: dict[str, Readout] = {}
"""Readouts of the presets of `events.presets` that have one."""


def named_readout(preset: str) -> Readout:
    """The readout of a preset, off if it has none. Raises ConfigError."""
    return preset_file.read_readout(preset) if preset.endswith(preset_file.SUFFIX) else READOUTS.get(preset, OFF)
