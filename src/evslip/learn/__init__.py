"""Detectors: networks, training, evaluation, streaming. Needs the extra `learn`; never imports the physics."""

from importlib.util import find_spec

from evslip.errors import MissingExtraError

if not all(map(find_spec, ("torch", "safetensors", "tensorboard"))):
    raise MissingExtraError("detectors need PyTorch; pip install -c constraints.txt 'evslip[learn]'")

from evslip.learn.checkpoint import load_model
from evslip.learn.evaluate import evaluate
from evslip.learn.metrics import Metrics
from evslip.learn.networks import NETWORKS, build_model
from evslip.learn.settings import TrainSettings
from evslip.learn.spaces import Range, Space
from evslip.learn.stream import Detection, Detector, detect
from evslip.learn.sweep import Sweep, SweepSettings, sweep
from evslip.learn.train import TrainResult, train

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
