"""Spaces of training settings to search: the paper's grids, and files."""

from collections.abc import Callable
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from evslip.learn.networks import network_class
from evslip.learn.training.settings import TrainSettings
from evslip.utils.errors import ConfigError, DataError
from evslip.utils.toml import read_toml

Value = bool | int | float | str
VALIDATED_ON = ("protocol", "val_fraction")
"""Settings that choose the windows of validation."""
MOST_VALUES = 1000
"""Values of a list to choose from."""


@dataclass(frozen=True)
class Range:
    """Numbers between two, both included."""

    low: float
    high: float
    log: bool = False
    """Whether ratios count alike, as for learning rates, or differences."""
    whole: bool = False
    """Whether the numbers are whole."""


@dataclass(frozen=True)
class Space:
    """Values that are tried of each setting of training."""

    searched: dict[str, Range | tuple[Value, ...]]
    """A range, or values to choose from."""
    fixed: dict[str, Value] = field(default_factory=dict)
    """Settings that are the same in every trial, where they differ from what suits the network."""

    def check(self, model: str) -> None:
        """Raise ConfigError unless training takes every value at the space's ends."""
        network_class(model)
        known = {one.name for one in fields(TrainSettings)} - {"model", "seed"}
        for name in (*self.searched, *self.fixed):
            if name not in known:
                raise ConfigError(
                    f"{name}: no setting of training to search; expected some of {', '.join(sorted(known))}"
                )
            if name in VALIDATED_ON and name in self.searched:
                raise ConfigError(
                    f"{name}: decides on the windows of validation, and trials on others cannot be compared"
                )
        if not self.searched:
            raise ConfigError(f"space: names nothing to search; expected some of {', '.join(sorted(known))}")
        for name, values in self.searched.items():
            for value in ends(values):
                TrainSettings.of(model, **{**self.fixed, name: value}).require_suits()


def ends(values: Range | tuple[Value, ...]) -> tuple[Value, ...]:
    """Both ends of a range, or the values to choose from."""
    if not isinstance(values, Range):
        return values
    return (int(values.low), int(values.high)) if values.whole else (values.low, values.high)


def _paper_simple(model: str) -> Space:
    """For the Simple Set (495 runs): batch 8 to 512, learning rate .001 to .014, 600 epochs."""
    del model  # the same for all
    batches = (8, 16, 32, 64, 96, 128, 160, 256, 512)
    return Space({"batch": batches, "lr": Range(0.001, 0.014), "optimiser": ("adam", "rmsprop")}, _paper(600))


def _paper_complex(model: str) -> Space:
    """For the Complex Set (225 runs): ranges of each network's own, 400 epochs; others as the 3D-CNN."""
    batches, lr = {
        "mlp": ((256, 512, 1024, 2048, 3072), Range(5e-5, 3e-3, log=True)),
        "snn": ((512, 1024, 2048, 3072), Range(5e-5, 5e-3, log=True)),
    }.get(model, ((16, 32, 64, 128, 256, 512, 1024), Range(1e-4, 5e-2, log=True)))
    return Space({"batch": batches, "lr": lr, "optimiser": ("adam", "rmsprop")}, _paper(400))


def _paper(epochs: int) -> dict[str, Value]:
    return {"epochs": epochs, "patience": epochs, "schedule": "constant", "smoothing": 0.0, "flip": False}


def _augmented(model: str) -> Space:
    """For few windows: what keeps a network from learning them by heart, at rates around those that suit it."""
    usual = TrainSettings.of(model)
    searched: dict[str, Range | tuple[Value, ...]] = {
        "lr": Range(usual.lr / 4, usual.lr * 4, log=True),
        "weight_decay": Range(1e-4, 1e-1, log=True),
        "shift_px": (0, 2, 4, 8, 16),
        "time_dropout": (0.0, 0.3),
        "event_dropout": (0.0, 0.5),
    }
    return Space(searched, {"epochs": 30, "patience": 10})


_SHORT = Space(
    {"batch": (8, 16, 32, 64), "lr": Range(5e-4, 2e-2, log=True), "weight_decay": Range(1e-5, 1e-2, log=True)},
    {"epochs": 12},
)
"""For a first look: what matters most, in few epochs."""
PRESETS: dict[str, Callable[[str], Space]] = {
    "short": lambda model: _SHORT,
    "augmented": _augmented,
    "paper-simple": _paper_simple,
    "paper-complex": _paper_complex,
}
"""By name: what makes the space for a network."""


def space_of(name: str, model: str) -> Space:
    """A preset, or a TOML file. Raises ConfigError, DataError."""
    if name.endswith(".toml"):
        space = _from_file(Path(name))
    elif name in PRESETS:
        space = PRESETS[name](model)
    else:
        raise ConfigError(f"space: {name!r} is unknown; expected one of {', '.join(PRESETS)}, or a .toml file")
    space.check(model)
    return space


def _from_file(path: Path) -> Space:
    try:
        content = read_toml(path)
    except ValueError as error:
        raise DataError(f"{path}: cannot be read as TOML: {' '.join(str(error).split())[:100]}") from None
    searched: dict[str, Range | tuple[Value, ...]] = {}
    fixed: dict[str, Value] = {}
    for name, value in content.items():
        if isinstance(value, dict):
            searched[name] = _range(path, name, value)
        elif isinstance(value, list):
            if not 0 < len(value) <= MOST_VALUES:
                given = f"a list of {len(value):,} values" if value else "an empty list"
                raise ConfigError(f"{path}: {name}: {given}; expected 1 to {MOST_VALUES:,} values")
            searched[name] = tuple(value)
        else:
            fixed[name] = value
    return Space(searched, fixed)


def _range(path: Path, name: str, value: dict[str, Any]) -> Range:
    low, high, log = value.get("min"), value.get("max"), value.get("log", False)
    numbers = all(
        isinstance(end, int | float) and not isinstance(end, bool) and abs(end) < 1e300 for end in (low, high)
    )
    if not numbers or set(value) - {"min", "max", "log"} or not isinstance(log, bool):
        raise ConfigError(f"{path}: {name}: expected {{ min = NUMBER, max = NUMBER, log = true or false }}")
    assert low is not None and high is not None  # they are numbers
    if not low < high or (log and low <= 0):
        raise ConfigError(f"{path}: {name}: min {low:g}, max {high:g}: expected min < max{', 0 < min' if log else ''}")
    return Range(float(low), float(high), log, isinstance(low, int) and isinstance(high, int))
