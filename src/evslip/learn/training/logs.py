"""The course of a training, for TensorBoard and Weights & Biases."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from importlib.util import find_spec
from pathlib import Path

from evslip.learn.training.settings import TrainSettings
from evslip.utils.errors import MissingExtraError

TENSORBOARD = "tensorboard"


Log = Callable[[int, dict[str, float]], None]
"""Takes the number of an epoch and its figures."""


@contextmanager
def logs(folder: Path, settings: TrainSettings, first_epoch: int, wandb: bool) -> Iterator[Log]:
    """Write figures into the folder `tensorboard`, and with `wandb` to a run of the project evslip (offline if
    WANDB_MODE says so). A training that goes on replaces what was written from `first_epoch` on.

    Raises MissingExtraError.
    """
    if wandb and not find_spec("wandb"):
        raise MissingExtraError("--wandb needs Weights & Biases; pip install 'evslip[wandb]'")
    from torch.utils.tensorboard import SummaryWriter

    run = None
    if wandb:
        from wandb import init  # pyright: ignore[reportMissingImports] (an extra)

        name = f"{settings.model}-{settings.seed}"
        run = init(project="evslip", name=name, dir=folder, config=asdict(settings))
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
