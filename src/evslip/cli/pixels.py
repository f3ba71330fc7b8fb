"""Options for every parameter of the event pixels, made from the parameter model itself."""

from dataclasses import field as dataclass_field
from dataclasses import fields, make_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from tyro.conf import arg

from evslip.events.datasheet import UNITS, meanings
from evslip.events.presets import LIMITS, MAPS, PARAMETERS
from evslip.utils.errors import ConfigError, DataError

GROUPS = {
    "thresholds": ("theta", "sigma", "theta_on", "theta_off", "refractory_us"),
    "photoreceptor": ("cutoff_hz", "dark", "photoreceptor_noise"),
    "noise": (
        "leak_rate_hz",
        "leak_spread",
        "leak_jitter",
        "leak_map",
        "shot_rate_hz",
        "hot_share",
        "hot_rate_hz",
        "dead_share",
        "noise_map",
    ),
    "mode_v2e_only": ("surround_pixels", "surround_us", "adaptive_us", "adaptive_spread"),
}
"""How --help groups the parameters; those that are not named here come in a group of their own."""
_ABOUT = {
    "thresholds": "Comparator of the event pixels. Default of each parameter: the preset's, see `evslip show camera`.",
    "photoreceptor": "From light to the signal that is compared.",
    "noise": "Events without a change of light.",
    "mode_v2e_only": "Pixels that only mode v2e has.",
    "others": "Other parameters of the pixels.",
}


def _option(name: str, text: str) -> Any:
    """The annotated type of an option."""
    low, high = LIMITS[name]
    kind, shown = float | None, "NUMBER"
    if name == "noise_map":
        kind, shown, text = str | None, "FILE", f"{text} FILE: .npz of `evslip calibrate-noise`."
    elif name in MAPS:
        kind, shown, text = str | None, "NUMBER|FILE", f"{text} FILE: .npy of shape (height, width)."
    meaning = f"{text} [{UNITS[name]}, {low:g} to {high:g}]"
    return Annotated[kind, arg(metavar=shown, help=meaning, help_behavior_hint="(default: the preset's)")]


def pixel_options() -> Any:
    """A dataclass whose fields are groups of options, each option None until it is given."""
    grouped = {name for names in GROUPS.values() for name in names}
    groups = GROUPS | {"others": tuple(name for name in PARAMETERS if name not in grouped)}
    texts = meanings()
    members = []
    for title, names in groups.items():
        known = [name for name in names if name in PARAMETERS]
        if not known:
            continue
        group = make_dataclass(title, [(name, _option(name, texts[name]), None) for name in known], frozen=True)
        group.__doc__ = _ABOUT[title]
        members.append((title, group, dataclass_field(default_factory=group)))
    options = make_dataclass("PixelOptions", members, frozen=True)
    options.__doc__ = "Parameters of the event pixels."
    return options


if TYPE_CHECKING:

    class PixelOptions:
        """What `pixel_options` makes."""

else:
    PixelOptions = pixel_options()


def parameters_of(options: Any) -> dict[str, Any]:
    """What of the options was given, as keyword arguments of EventCamera. Raises ConfigError, DataError."""
    given = {}
    for group in fields(options):
        for name, value in vars(getattr(options, group.name)).items():
            if value is not None:
                given[name] = _value(name, value) if name in MAPS else value
    return given


def _value(name: str, text: str) -> Any:
    """A number, or the array in the file of that name."""
    from evslip.events.noise_map import load_noise_map

    if name == "noise_map":
        return load_noise_map(text)
    try:
        return float(text)
    except ValueError:
        pass
    path = Path(text)
    if path.suffix.lower() != ".npy":
        raise ConfigError(f"camera parameter {name}: {text!r} is neither a number nor the name of an .npy file")
    if not path.is_file():
        raise DataError(f"{path}: there is no such file")
    try:
        return np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError) as error:
        reason = " ".join(str(error).split())[:160]
        raise DataError(f"{path}: not an .npy file of numbers ({reason})") from None
