"""The event camera that a sample's parameters ask for."""

from evslip.config.params import Params
from evslip.events import EventCamera, Readout
from evslip.events.readout.presets import named_readout
from evslip.events.readout.settings import with_changes
from evslip.utils import seeds


def readout_of(params: Params) -> Readout:
    """The readout of a sample's camera. Raises ConfigError."""
    return with_changes(named_readout(params.sensor.preset), params.readout.model_dump(exclude_none=True))


def camera_for(params: Params, threads: int = 1) -> EventCamera:
    """The event camera of a sample."""
    overrides = params.sensor.model_dump(exclude={"preset"}, exclude_none=True)
    seed = seeds.integer(params.seed, params.split, params.index, "pixels")
    size = (params.camera.width, params.camera.height)
    readout = readout_of(params)
    return EventCamera(params.sensor.preset, size=size, seed=seed, threads=threads, readout=readout, **overrides)
