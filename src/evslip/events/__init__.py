"""Event cameras: streams of events, and the simulation of the pixels that make them.

Begin with `camera.EventCamera`, then `pixels.pixel` (one pixel between two frames) and `presets` (what can be set).
A new sensor is an entry of `presets.PRESETS`; a new rule of the pixels is a folder beside `pixels` and `v2e`.
"""

import importlib
from typing import TYPE_CHECKING, Any

from evslip.events.stream import CAUSES, Events, concatenate, empty_events

if TYPE_CHECKING:
    from evslip.events.batch import EventCameras
    from evslip.events.camera import EventCamera
    from evslip.events.noise_map import load_noise_map, measure_noise, save_noise_map
    from evslip.events.pixel_model import PixelModel
    from evslip.events.presets import PRESETS
    from evslip.events.readout.settings import Readout

_LAZY = {
    "batch": ("EventCameras",),
    "camera": ("EventCamera",),
    "noise_map": ("load_noise_map", "measure_noise", "save_noise_map"),
    "pixel_model": ("PixelModel",),
    "presets": ("PRESETS",),
    "readout.settings": ("Readout",),
}
__all__ = [
    "CAUSES",
    "PRESETS",
    "EventCamera",
    "EventCameras",
    "Events",
    "PixelModel",
    "Readout",
    "concatenate",
    "empty_events",
    "load_noise_map",
    "measure_noise",
    "save_noise_map",
]


def __getattr__(name: str) -> Any:
    # Looked up on first use: those who only read events need no compiler.
    for module, names in _LAZY.items():
        if name in names:
            return getattr(importlib.import_module(f"evslip.events.{module}"), name)
    raise AttributeError(f"module 'evslip.events' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
