"""The event camera that a sample's parameters ask for."""

from evslip.config.params import Params
from evslip.events import EventCamera
from evslip.utils import seeds


def camera_for(params: Params, threads: int = 1) -> EventCamera:
    """The event camera of a sample."""
    overrides = params.sensor.model_dump(exclude={"preset"}, exclude_none=True)
    seed = seeds.integer(params.seed, params.split, params.index, "pixels")
    size = (params.camera.width, params.camera.height)
    readout = params.readout.model_dump(exclude_none=True)
    return EventCamera(params.sensor.preset, size=size, seed=seed, threads=threads, readout=readout, **overrides)
