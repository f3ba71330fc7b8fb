"""Detectors: networks, training, evaluation, streaming. Needs the extra `learn`; never imports the physics.

Begin with `networks.network.Network` (what every detector is), then `training.train` and `evaluation.assessment`.
A new network is a file in `networks` and a line in its register; your own needs neither: docs/how-to/own-network.md.
"""

from importlib.util import find_spec

from evslip.utils.errors import MissingExtraError

if not all(map(find_spec, ("torch", "safetensors", "tensorboard"))):
    raise MissingExtraError("detectors need PyTorch; pip install -c constraints.txt 'evslip[learn]'")

from evslip.learn.checkpoint import load_model
from evslip.learn.evaluation.evaluate import evaluate
from evslip.learn.networks import NETWORKS, build_model
from evslip.learn.scores.metrics import Metrics
from evslip.learn.search.spaces import Range, Space
from evslip.learn.search.sweep import Sweep, SweepSettings, sweep
from evslip.learn.streaming.stream import Detection, Detector, detect
from evslip.learn.training.settings import TrainSettings
from evslip.learn.training.train import TrainResult, train

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
    "build_model",
    "detect",
    "evaluate",
    "load_model",
    "sweep",
    "train",
]
