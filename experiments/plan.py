"""How large the experiment is, and where each part of it lies."""

from dataclasses import dataclass
from pathlib import Path

from worlds import FIXED, WORLDS

PAPERS = ("mlp", "snn", "cnn3d")
"""The networks of the paper."""
BASELINES = ("event_rate", "rate_map", "flow")
"""Found at once, without gradients."""
VARIANTS = {"countnet+noise": ("countnet", ("--noise-hz", "5"))}
"""Networks that are trained in another way: what is trained, and how."""
NETWORKS = (*PAPERS, "cnn3d_bn", "voxelnet", "countnet", *VARIANTS, "evgru", *BASELINES)
SWEEPS = tuple(
    f"{group}/{name}" for group in ("simple", "complex") for name in NETWORKS if name not in {*VARIANTS, *BASELINES}
)
"""What can be swept."""


@dataclass(frozen=True)
class Plan:
    """The whole experiment. The defaults are its full size."""

    out: Path
    """Folder of everything."""
    simple: int = 192
    """Samples of the Simple Set."""
    complex_train: int = 1000
    complex_test: int = 200
    world: int = 60
    """Samples of each shifted world ..."""
    traced: int = 10
    """... but of the path-traced one, which takes some seventy times as long."""
    ablation_train: int = 200
    """Training samples of each step of the ablation."""
    ablation_test: int = 60
    networks: tuple[str, ...] = NETWORKS
    seeds: tuple[int, ...] = (0, 1, 2)
    finals: tuple[str, ...] = ("cnn3d_bn", "voxelnet", "countnet", "countnet+noise")
    """Networks that are tried in shifted worlds and on real recordings."""
    ablated: tuple[str, ...] = ("countnet",)
    """Networks that the ablation trains."""
    worlds: tuple[str, ...] = tuple(WORLDS)
    ablations: tuple[str, ...] = tuple(FIXED)
    real: Path | None = None
    """Folder with real recordings."""
    keys: tuple[str, ...] = ()
    """KEY=VALUE, replaced in every data set."""
    window_hop_s: float = 0.16
    """From one training window's start to the next one's."""
    training: tuple[str, ...] = ()
    """OPTION=VALUE or NETWORK:OPTION=VALUE, given to `evslip train`."""
    sweeps: tuple[str, ...] = ("simple/mlp", "simple/snn")
    """SET/NETWORK whose settings are searched."""
    trials: int = 16
    """Of each sweep; 0: no sweep."""
    space: str = "augmented"
    """What a sweep tries."""
    hop_s: float = 0.01
    """Time between two answers in evaluations; latencies are exact to it."""
    resamples: int = 1000
    """Of the trajectories, for confidence intervals."""
    workers: int | None = None
    """Processes of each generator; None: one a core; 1: generators, too, run as many together as `jobs`."""
    jobs: int = 1
    """Trainings and evaluations at the same time."""
    ship_model: str | None = None
    """NETWORK-SEED to ship; None: the best final by validation."""
    ship_to: Path | None = None
    """Where to; None: the folder `default` of the experiment."""

    @property
    def searched(self) -> tuple[str, ...]:
        """The sweeps that are run."""
        return self.sweeps if self.trials else ()

    def data(self, name: str) -> Path:
        return self.out / "data" / name

    def windows(self, name: str) -> Path:
        return self.out / "windows" / f"{name}.h5"

    def model(self, group: str, network: str, seed: int) -> Path:
        return self.out / "models" / group / f"{network}-{seed}"

    def sweep(self, place: str) -> Path:
        return self.out / "sweeps" / place

    def evaluation(self, test_set: str, network: str, seed: int) -> Path:
        return self.out / "evaluations" / test_set / f"{network}-{seed}"

    def options(self, network: str) -> list[str]:
        """What `evslip train` is told of a network besides its name and seed."""
        words: list[str] = []
        for text in self.training:
            where, _, option = text.rpartition(":")
            name, equals, value = option.partition("=")
            if not equals:
                raise SystemExit(f"training: {text!r} is wrong, expected OPTION=VALUE or NETWORK:OPTION=VALUE")
            if where in ("", network):
                words += [f"--{name}", value]
        return words


SMALL = Plan(
    out=Path("reproduced-small"),
    simple=12,
    complex_train=16,
    complex_test=8,
    world=4,
    ablation_train=8,
    ablation_test=4,
    networks=(*PAPERS, "voxelnet", "event_rate"),
    seeds=(0,),
    finals=("voxelnet",),
    ablated=("event_rate",),
    worlds=("front", "mesh", "noise", "shake"),
    ablations=("lights", "threshold"),
    keys=(
        "camera.width=87",
        "camera.height=65",
        "render.max_motion_px=2.0",
        "motion.duration_s=6.0",
        "slip_fraction=0.5",
    ),
    window_hop_s=0.04,
    training=("epochs=2",),
    sweeps=("simple/mlp", "complex/voxelnet"),
    trials=2,
    space="experiments/small_space.toml",
    hop_s=0.08,
    resamples=100,
    workers=1,
    jobs=2,
)
"""Every stage once, in less than ten minutes on two cores; what it measures is of no meaning."""
