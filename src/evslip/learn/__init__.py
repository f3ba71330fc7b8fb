"""Detectors: networks, training, evaluation, streaming. Needs the extra `learn`; never imports the physics.

Begin with `networks.network.Network` (what every detector is), then `training.train` and `evaluation.evaluation`.
A new network is a file in `networks` and a line in its register; your own needs neither: docs/how-to/own-network.md.
"""

import importlib
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from evslip.utils.errors import MissingName

if TYPE_CHECKING:
    from evslip.learn.checkpoint import load_model
    from evslip.learn.evaluation.evaluation import evaluate
    from evslip.learn.networks import NETWORKS, build_model
    from evslip.learn.scores.metrics import Metrics
    from evslip.learn.search.spaces import Range, Space
    from evslip.learn.search.sweep import Sweep, SweepSettings, sweep
    from evslip.learn.streaming.stream import Detection, Detector, detect
    from evslip.learn.training.settings import TrainSettings
    from evslip.learn.training.train import TrainResult, train
    from evslip.learn.window_datasets import WindowDataset, WindowStream

_LAZY = {
    "checkpoint": ("load_model",),
    "evaluation.evaluation": ("evaluate",),
    "networks": ("NETWORKS", "build_model"),
    "scores.metrics": ("Metrics",),
    "search.spaces": ("Range", "Space"),
    "search.sweep": ("Sweep", "SweepSettings", "sweep"),
    "streaming.stream": ("Detection", "Detector", "detect"),
    "training.settings": ("TrainSettings",),
    "training.train": ("TrainResult", "train"),
    "window_datasets": ("WindowDataset", "WindowStream"),
}
__all__ = [
    "NETWORKS",
    "Detection",
    "Detector",
    "Metrics",
    "Range",
    "Space",
    "Sweep",
    "SweepSettings",
    "TrainResult",
    "TrainSettings",
    "WindowDataset",
    "WindowStream",
    "build_model",
    "detect",
    "evaluate",
    "load_model",
    "sweep",
    "train",
]


def __getattr__(name: str) -> Any:
    # Looked up on first use: the command line explains the settings of training without PyTorch.
    home = next((module for module, names in _LAZY.items() if name in names), None)
    if home is None:
        raise AttributeError(f"module 'evslip.learn' has no attribute {name!r}")
    if not all(map(find_spec, ("torch", "safetensors", "tensorboard"))):
        return MissingName(name, "detectors need PyTorch; pip install 'evslip[learn]'")
    return getattr(importlib.import_module(f"evslip.learn.{home}"), name)


def __dir__() -> list[str]:
    return __all__
