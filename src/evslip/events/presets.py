"""Named sets of values of the event pixels and of readouts, those of files too, and what replaces them."""

from dataclasses import replace
from typing import Any

import numpy as np

from evslip.events import preset_file
from evslip.events.pixel_model import LIMITS, MAPS, OPTIONAL, PARAMETERS, PixelModel
from evslip.events.readout.settings import OFF, Readout
from evslip.utils.errors import ConfigError

PRESETS: dict[str, PixelModel] = {
    "davis346": PixelModel(
        theta=0.15, sigma=0.03, cutoff_hz=15.0, leak_rate_hz=0.01, shot_rate_hz=0.001, refractory_us=500.0
    ),
    "davis346-bright": PixelModel(
        theta_on=0.270,
        theta_off=0.297,
        sigma=0.041,
        cutoff_hz=2945.0,
        cutoff_dark=0.113,
        leak_rate_hz=0.0037,
        shot_rate_hz=0.0014,
        shot_white=0.0,
        refractory_us=68.0,
        dark=0.0732,
    ),
    "davis346-dim": PixelModel(
        theta_on=0.27,
        theta_off=0.297,
        sigma=0.041,
        cutoff_hz=15.0,
        refractory_us=500.0,
        shot_rate_hz=11.1,
        shot_white=5e-4,
        shot_on_share=0.567,
        shot_spread=0.22,
        leak_rate_hz=0.062,
        leak_light_hz=1e-4,
        leak_spread=0.16,
        hot_share=0.022,
        hot_rate_hz=2.4,
    ),
    "dvxplorer": PixelModel(
        theta=0.2, sigma=0.02, cutoff_hz=390.0, leak_rate_hz=0.01, shot_rate_hz=0.03, refractory_us=200.0
    ),
    "dvxplorer-lite": PixelModel(theta=0.2, sigma=0.02, cutoff_hz=390.0, leak_rate_hz=0.01, shot_rate_hz=0.03),
    "prophesee-like": PixelModel(
        theta=0.22, sigma=0.02, cutoff_hz=1060.0, leak_rate_hz=0.01, shot_rate_hz=0.1, refractory_us=10.0
    ),
    "clean": PixelModel(theta=0.2, sigma=0.02),
    "noisy": PixelModel(theta=0.2, sigma=0.05, cutoff_hz=30.0, leak_rate_hz=0.1, shot_rate_hz=5.0),
}
"""Named settings: davis346 is what the slip detection paper gave to v2e; davis346-bright is what `evslip calibrate` has
fitted to a street by day, which hardly tells its corner and refractory period; davis346-dim is for a scene whose white
is lit by 4 lux: thresholds of davis346-bright, bandwidth and refractory period of davis346, all noise as measured on
another sensor (docs/explanation/realism.md has both); clean and noisy are v2e's own (Hu, Liu, Delbruck, v2e: from video
frames to realistic DVS events, CVPR workshops 2021). dvxplorer (Samsung VGA) and prophesee-like (Gen4, IMX636) follow
what is public about these sensors; dvxplorer-lite has dvxplorer's pixels behind the event frames of a recording, in
place of a refractory period that stands for them (`READOUTS`); docs/reference/cameras.md gives the source of
each value. Biases change all of them: `evslip calibrate` fits a camera at hand."""

FITTED = ("davis346-bright",)
"""Presets fitted to frames whose codes were taken as light, as those of files are."""
READOUTS: dict[str, Readout] = {"dvxplorer-lite": Readout(frame_us=197.28, scan_us=-192.0)}
"""Readouts of the presets that have one. dvxplorer-lite: measured in a recording of a DVXplorer Lite (320 x 240 pixels)
by `benchmarks/readout.py recording`; other settings of its clock give other frames."""


def named(preset: str) -> PixelModel:
    """A preset by its name, or of a TOML file, see `preset_file`. Raises ConfigError."""
    if preset in PRESETS:
        return PRESETS[preset]
    if preset.endswith(preset_file.SUFFIX):
        return preset_file.read(preset)
    raise ConfigError(f"camera preset {preset!r} is unknown; expected one of {', '.join(PRESETS)}, or a .toml file")


def named_readout(preset: str) -> Readout:
    """The readout of a preset, off if it has none. Raises ConfigError."""
    return preset_file.read_readout(preset) if preset.endswith(preset_file.SUFFIX) else READOUTS.get(preset, OFF)


def resolve(preset: str, parameters: dict[str, Any], shape: tuple[int, int]) -> PixelModel:
    """A preset with some parameters replaced, checked. Raises ConfigError naming the parameter."""
    base = named(preset)
    for name in parameters:
        if name not in PARAMETERS:
            raise ConfigError(f"camera parameter {name!r} is unknown; expected one of {', '.join(PARAMETERS)}")
    # What is asked for both polarities replaces what the preset has for each.
    own = {side: None for both in ("theta", "sigma") if both in parameters for side in (f"{both}_on", f"{both}_off")}
    given = preset_file.maps_of(base) | own | parameters
    model = replace(base, **{name: _checked(name, value, shape) for name, value in given.items()})
    if model.photoreceptor_noise > 0 and model.cutoff_hz == 0:
        raise ConfigError("camera parameter photoreceptor_noise: needs a low-pass to limit its band; set cutoff_hz")
    return model


def _checked(name: str, value: Any, shape: tuple[int, int]) -> Any:
    if value is None and name in OPTIONAL:
        return None
    try:
        numbers = np.asarray(value, np.float64)
    except (TypeError, ValueError):
        raise ConfigError(f"camera parameter {name}: {value!r} is not a number") from None
    wanted = (2, *shape) if name == "noise_map" else shape
    is_map = name in MAPS and numbers.shape == wanted
    if isinstance(value, bool) or not (is_map or (numbers.ndim == 0 and name != "noise_map")):
        expected = f"an array of shape {wanted}" if name in MAPS else "a number"
        given = f"an array of shape {numbers.shape}" if numbers.ndim else repr(value)
        raise ConfigError(f"camera parameter {name}: {given} given, expected {expected}")
    if name == "leak_map" and not numbers.ndim:
        numbers = np.full(shape, numbers)
    low, high = LIMITS[name]
    bad = numbers[~((numbers >= low) & (numbers <= high))]
    if bad.size:
        raise ConfigError(f"camera parameter {name}: {bad.flat[0]:g} is out of range, expected {low:g} to {high:g}")
    return numbers if numbers.ndim else float(numbers)
