"""Synthetic event-camera data for slip detection: simulate, render, turn into events, label, train, measure."""

import importlib
from typing import TYPE_CHECKING, Any

from evslip.utils.errors import MissingName
from evslip.utils.version import __version__ as __version__

if TYPE_CHECKING:
    from evslip import learn
    from evslip.codecs import read_events, write_events
    from evslip.config.config import Config
    from evslip.config.loading import load_config
    from evslip.config.params import Params
    from evslip.data.dataset import Dataset, open_dataset
    from evslip.data.record import Record
    from evslip.draws.draw import draw
    from evslip.events import EventCamera
    from evslip.events.frame import Frame
    from evslip.events.stream import Events
    from evslip.generation.generate import generate
    from evslip.generation.warm_up import warm_up
    from evslip.learn import Detector
    from evslip.physics.onset import onset_mass
    from evslip.physics.simulation import simulate
    from evslip.physics.trajectory import Trajectory
    from evslip.physics.truth import Truth, angular_difference, measure
    from evslip.rendering import render
    from evslip.utils.errors import EvslipError
    from evslip.windows.window_set import open_windows

_HOME = {
    "Config": "config.config",
    "Dataset": "data.dataset",
    "Detector": "learn",
    "EventCamera": "events",
    "Events": "events.stream",
    "EvslipError": "utils.errors",
    "Frame": "events.frame",
    "Params": "config.params",
    "Record": "data.record",
    "Trajectory": "physics.trajectory",
    "Truth": "physics.truth",
    "angular_difference": "physics.truth",
    "draw": "draws.draw",
    "generate": "generation.generate",
    "load_config": "config.loading",
    "measure": "physics.truth",
    "onset_mass": "physics.onset",
    "open_dataset": "data.dataset",
    "open_windows": "windows.window_set",
    "read_events": "codecs",
    "render": "rendering",
    "simulate": "physics.simulation",
    "warm_up": "generation.warm_up",
    "write_events": "codecs",
}
__all__ = [
    "Config",
    "Dataset",
    "Detector",
    "EventCamera",
    "Events",
    "EvslipError",
    "Frame",
    "Params",
    "Record",
    "Trajectory",
    "Truth",
    "angular_difference",
    "draw",
    "generate",
    "learn",
    "load_config",
    "measure",
    "onset_mass",
    "open_dataset",
    "open_windows",
    "read_events",
    "render",
    "simulate",
    "warm_up",
    "write_events",
]


def __getattr__(name: str) -> Any:
    # Names are looked up on first use: importing evslip does no work and needs neither numba nor torch nor mujoco.
    if name == "learn":
        return importlib.import_module("evslip.learn")
    if name in _HOME:
        value = getattr(importlib.import_module(f"evslip.{_HOME[name]}"), name)
        if not isinstance(value, MissingName):
            globals()[name] = value  # `render`, `generate`, `simulate`: the function, not the module of that name
        return value
    raise AttributeError(f"module 'evslip' has no attribute {name!r}")


def __dir__() -> list[str]:
    return ["__version__", *__all__]
