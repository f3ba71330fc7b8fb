"""Synthetic event-camera data for slip detection: simulate, render, turn into events, label, train, measure."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from evslip import learn
    from evslip.codecs import read_events, write_events
    from evslip.config import Config, load_config
    from evslip.dataset import Dataset, open_dataset
    from evslip.draws import draw
    from evslip.errors import EvslipError
    from evslip.events import EventCamera
    from evslip.events.stream import Events
    from evslip.frame import Frame
    from evslip.generation import generate
    from evslip.learn import Detector
    from evslip.onset import onset_mass
    from evslip.params import Params
    from evslip.record import Record
    from evslip.rendering import render
    from evslip.simulation import simulate
    from evslip.trajectory import Trajectory
    from evslip.truth import Truth, angular_difference, measure

__version__ = "0.1.0"

_HOME = {
    "Config": "config",
    "Dataset": "dataset",
    "Detector": "learn",
    "EventCamera": "events",
    "Events": "events.stream",
    "EvslipError": "errors",
    "Frame": "frame",
    "Params": "params",
    "Record": "record",
    "Trajectory": "trajectory",
    "Truth": "truth",
    "angular_difference": "truth",
    "draw": "draws",
    "generate": "generation",
    "load_config": "config",
    "measure": "truth",
    "onset_mass": "onset",
    "open_dataset": "dataset",
    "read_events": "codecs",
    "render": "rendering",
    "simulate": "simulation",
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
    "read_events",
    "render",
    "simulate",
    "write_events",
]


def __getattr__(name: str) -> Any:
    # Names are looked up on first use: importing evslip does no work and needs neither numba nor torch nor mujoco.
    if name == "learn":
        return importlib.import_module("evslip.learn")
    if name in _HOME:
        value = getattr(importlib.import_module(f"evslip.{_HOME[name]}"), name)
        globals()[name] = value  # `render`, `generate`, `simulate`: the function, not the module of that name
        return value
    raise AttributeError(f"module 'evslip' has no attribute {name!r}")
