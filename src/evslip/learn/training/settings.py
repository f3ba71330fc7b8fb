"""How a detector is trained."""

from dataclasses import dataclass, fields
from typing import Any, Literal, get_args

from evslip.utils.errors import ConfigError
from evslip.utils.kinds import KINDS, plain, suits

OptimiserName = Literal["adam", "rmsprop"]
Schedule = Literal["cycle", "constant"]
Protocol = Literal["trajectory", "paper"]
Precision = Literal["float32", "bfloat16"]
BY_NETWORK = ("epochs", "batch", "lr", "schedule", "optimiser", "weight_decay", "smoothing", "patience", "flip")
"""Settings that `Network.recommended` may name."""


@dataclass(frozen=True)
class TrainSettings:
    """How a detector is trained."""

    model: str = "cnn3d_bn"
    """Name of the network."""
    epochs: int = 14
    """Most passes over the training windows."""
    batch: int = 16
    """Windows a step."""
    lr: float = 4e-3
    """Learning rate, the highest of a cycle."""
    schedule: Schedule = "cycle"
    """cycle: the rate rises over a fifth of the steps, then falls to nothing by a cosine. constant: as in the paper."""
    optimiser: OptimiserName = "adam"
    """adam (AdamW) or rmsprop."""
    weight_decay: float = 1e-4
    """How strongly weights are pulled towards 0: apart from the gradient with adam, as an L2 penalty with rmsprop."""
    smoothing: float = 0.05
    """Label smoothing: keeps the probabilities of few windows from running to 0 and 1."""
    patience: int = 6
    """Epochs without a better validation loss before training stops."""
    val_fraction: float = 0.2
    """Share of the trajectories kept for validation."""
    protocol: Protocol = "trajectory"
    """trajectory: validation is on other trajectories. paper: on other windows of the same ones, chosen as the paper's
    public code does; for comparison."""
    flip: bool = True
    """Mirror half of the windows left to right: gravity has no left."""
    recombine: float = 0.0
    """Share of the windows whose object is shown over all the rest of another window, of a camera at the same mount.
    Only for windows of simulated samples."""
    reverse: bool = False
    """Play half of the windows backwards, with ON and OFF changed over: so an edge looks that moves the other way. Only
    for networks without speeds, and where the label counts movement of either sense in the whole window."""
    shift_px: int = 0
    """Move each window by up to so many pixels in both directions."""
    time_dropout: float = 0.0
    """Silence a span of each window, up to this share of its length."""
    event_dropout: float = 0.0
    """Remove a share of each window's events, up to this one."""
    noise_hz: float = 0.0
    """Add events at random, as a sensor's shot noise is: to each window so many a second and pixel, from 0 to this,
    small rates more often."""
    noise: str = ""
    """Recording whose events are added: to each window a part of random start, of which a random share is taken."""
    start: str = ""
    """Detector of the same network that training starts from, a folder or a name such as default, to go on with data of
    your own."""
    precision: Precision = "float32"
    """Numbers in convolutions and linear layers while training; weights and losses stay float32. bfloat16 takes about
    half the time where the processor has such instructions (AVX-512 BF16, AMX) or a GPU trains."""
    seed: int = 0
    """Seed of initial weights, order and augmentation."""

    def __post_init__(self) -> None:
        for one in fields(self):
            value = plain(getattr(self, one.name))
            if not suits(value, one.type):
                raise ConfigError(f"{one.name} {value!r:.60}: expected {KINDS.get(one.type, 'a word')}")
            object.__setattr__(self, one.name, value)
        if self.epochs < 1 or self.batch < 2 or not self.lr > 0 or self.patience < 1:
            raise ConfigError(
                f"epochs {self.epochs}, batch {self.batch}, lr {self.lr:g}, patience {self.patience}: "
                "expected at least 1, at least 2, more than 0, at least 1"
            )
        for name, values in (
            ("optimiser", OptimiserName),
            ("schedule", Schedule),
            ("protocol", Protocol),
            ("precision", Precision),
        ):
            if getattr(self, name) not in get_args(values):
                raise ConfigError(f"{name} {getattr(self, name)!r}: expected one of {', '.join(get_args(values))}")
        if not 0 <= self.weight_decay < 1 or not 0 <= self.smoothing < 1:
            raise ConfigError(
                f"weight_decay {self.weight_decay:g}, smoothing {self.smoothing:g}: expected at least 0 and less than 1"
            )
        if not 0 <= self.seed < 2**64:  # torch takes no greater one
            raise ConfigError(f"seed {self.seed}: expected 0 or more, and less than 2**64")
        if not 0 < self.val_fraction < 1:
            raise ConfigError(f"val_fraction {self.val_fraction:g}: expected more than 0 and less than 1")
        if not 0 <= self.recombine <= 1:
            raise ConfigError(f"recombine {self.recombine:g}: expected 0 to 1")
        if not 0 <= self.noise_hz <= 1000:
            raise ConfigError(f"noise_hz {self.noise_hz:g}: expected 0 to 1000")
        if not (0 <= self.time_dropout < 1 and 0 <= self.event_dropout < 1 and 0 <= self.shift_px <= 100):
            raise ConfigError(
                f"time_dropout {self.time_dropout:g}, event_dropout {self.event_dropout:g}, shift_px {self.shift_px}: "
                "expected at least 0 and less than 1, the same, 0 to 100"
            )

    def require_suits(self) -> None:
        """Raise ConfigError for what is not for the network."""
        from evslip.learn.networks import network_class
        from evslip.learn.networks.speed_network import SpeedNetwork

        network = network_class(self.model)
        if self.precision not in network.precisions:
            expected = " or ".join(network.precisions)
            raise ConfigError(f"precision {self.precision}: not for a {self.model}; expected {expected}")
        if self.reverse and issubclass(network, SpeedNetwork):
            raise ConfigError(
                f"reverse: a {self.model} estimates speeds, which are those of a window's end; expected no reverse"
            )

    @classmethod
    def of(cls, model: str, **chosen: Any) -> "TrainSettings":
        """Settings that suit the network, except for the chosen ones; None is not chosen. Raises ConfigError."""
        from evslip.learn.networks import network_class  # and with it PyTorch

        given = {name: value for name, value in chosen.items() if value is not None}
        unknown = given.keys() - {field.name for field in fields(cls)}
        if unknown:
            raise ConfigError(f"{min(unknown)}: no setting of training; see TrainSettings")
        return cls(**{"model": model, **network_class(model).recommended, **given})

    def words(self) -> list[str]:
        """Options of `evslip train` that give these settings."""
        usual = TrainSettings.of(self.model)
        words = ["--network", self.model]
        for field in fields(self):
            option, value = field.name.replace("_", "-"), getattr(self, field.name)
            if value == getattr(usual, field.name) and field.name != "seed":
                continue
            if isinstance(value, bool):
                words.append(f"--{option}" if value else f"--no-{option}")
            else:
                words += [f"--{option}", str(value)]
        return words
