"""Statistics of features, as LeRobot's format has them of a data set and of each episode."""

from typing import Any

import numpy as np

from evslip.exchange.publishing.lerobot_meta import CAMERA


class Stats:
    """Least, largest, mean and standard deviation of each feature; of pictures for each colour, in units of white."""

    def __init__(self) -> None:
        self._sums: dict[str, list[Any]] = {}

    def add(self, columns: dict[str, np.ndarray], images: list[np.ndarray]) -> None:
        for name, values in columns.items():
            self._add(name, values.reshape(len(values), -1).astype(np.float64), values.shape[1:] or (1,), len(values))
        grey = [np.stack([i] * 3, -1) if i.ndim == 2 else i for i in images]
        pixels = np.concatenate([image.reshape(-1, 3)[::16] for image in grey]) / 255.0
        self._add(CAMERA, pixels, (3, 1, 1), len(images))

    def _add(self, name: str, rows: np.ndarray, shape: tuple[int, ...], frames: int) -> None:
        new = [rows.min(0), rows.max(0), rows.sum(0), (rows**2).sum(0), len(rows), frames, shape]
        old = self._sums.get(name)
        if old is not None:
            new[:2] = np.minimum(old[0], new[0]), np.maximum(old[1], new[1])
            new[2:6] = [a + b for a, b in zip(old[2:6], new[2:6], strict=True)]
        self._sums[name] = new

    def table(self) -> dict[str, Any]:
        found = {}
        for name, (low, high, total, squares, number, frames, shape) in self._sums.items():
            mean = total / number
            deviation = np.sqrt(np.maximum(squares / number - mean**2, 0.0))
            four = {"min": low, "max": high, "mean": mean, "std": deviation}
            found[name] = {key: values.reshape(shape).tolist() for key, values in four.items()} | {"count": [frames]}
        return found

    def row(self) -> dict[str, Any]:
        """All of them as columns of meta/episodes."""
        return {f"stats/{name}/{key}": value for name, stats in self.table().items() for key, value in stats.items()}
