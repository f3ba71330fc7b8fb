"""Synthetic event-camera data for slip detection: simulate, render, turn into events, label, train, measure."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from evslip.config import Config, load_config
    from evslip.params import Params, draw
    from evslip.trajectory import Trajectory

__version__ = "0.1.0"

_PUBLIC = {
    "Config": "config",
    "Params": "params",
    "Trajectory": "trajectory",
    "draw": "params",
    "load_config": "config",
}
__all__ = ["Config", "Params", "Trajectory", "draw", "load_config"]


def __getattr__(name: str) -> Any:
    # Names are looked up on first use: importing evslip does no work and needs neither numba nor torch nor mujoco.
    if name in _PUBLIC:
        return getattr(importlib.import_module(f"evslip.{_PUBLIC[name]}"), name)
    raise AttributeError(f"module 'evslip' has no attribute {name!r}")
