"""The course of a training, for TensorBoard and Weights & Biases."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from importlib.util import find_spec
from pathlib import Path
from typing import Protocol

from evslip.learn.training.settings import TrainSettings
from evslip.utils.errors import MissingExtraError

TENSORBOARD = "tensorboard"


class Log(Protocol):
    """Takes an epoch's figures."""

    def __call__(self, epoch: int, row: dict[str, float]) -> None: ...


@contextmanager
def logs(folder: Path, settings: TrainSettings, first_epoch: int, wandb: bool) -> Iterator[Log]:
    """Write figures into the folder `tensorboard`, and with `wandb` to a run of the project evslip (offline if
    WANDB_MODE says so). A training that goes on replaces what was written from `first_epoch` on.

    Raises MissingExtraError.
    """
    if wandb and not find_spec("wandb"):
        raise MissingExtraError("--wandb needs Weights & Biases; pip install -c constraints.txt 'evslip[wandb]'")
    from torch.utils.tensorboard import SummaryWriter

    run = _wandb_run(folder, settings) if wandb else None
    writer = SummaryWriter(str(folder / TENSORBOARD), purge_step=first_epoch)

    def write(epoch: int, row: dict[str, float]) -> None:
        for name, value in row.items():
            kind = "validation" if name.startswith("val_") else "training"
            writer.add_scalar(f"{kind}/{name.removeprefix('val_')}", value, epoch)
        writer.flush()
        if run is not None:
            run.log(row, step=epoch)

    try:
        yield write
    finally:
        writer.close()
        if run is not None:
            run.finish()


def _wandb_run(folder: Path, settings: TrainSettings):
    import wandb  # pyright: ignore[reportMissingImports] (an extra)

    return wandb.init(project="evslip", name=f"{settings.model}-{settings.seed}", dir=folder, config=asdict(settings))
