"""The event camera that a sample's parameters ask for."""

from typing import Any

from evslip.config.params import Params
from evslip.events import EventCamera, PixelModel, Readout
from evslip.events.presets import named_readout, resolve
from evslip.events.readout.settings import with_changes
from evslip.utils import seeds


def readout_of(params: Params) -> Readout:
    """The readout of a sample's camera. Raises ConfigError."""
    return with_changes(named_readout(params.sensor.preset), params.readout.model_dump(exclude_none=True))


def pixels_of(params: Params) -> PixelModel:
    """The pixels of a sample's camera. Raises ConfigError."""
    return resolve(params.sensor.preset, _overrides(params), (params.camera.height, params.camera.width))


def camera_for(params: Params, threads: int = 1) -> EventCamera:
    """The event camera of a sample."""
    seed = seeds.integer(params.seed, params.split, params.index, params.stage("pixels"))
    size = (params.camera.width, params.camera.height)
    readout = readout_of(params)
    return EventCamera(
        params.sensor.preset, size=size, seed=seed, threads=threads, readout=readout, **_overrides(params)
    )


def _overrides(params: Params) -> dict[str, Any]:
    return params.sensor.model_dump(exclude={"preset"}, exclude_none=True)
