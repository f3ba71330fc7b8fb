"""Windows as pairs of a structured array and a label, as tonic's data sets give theirs."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from evslip.windows.window_set import Windows


class LabelledEvents(Sequence[tuple[Any, Any]]):
    """Pairs (events, label) of windows: events in tonic's structured array, t in microseconds since the window's start,
    x and y in the crop; label 0 for hold, 1 for slip. `transform` changes the one, `target_transform` the other.

    tonic's transforms, its caches and PyTorch's DataLoader take it as one of tonic's own data sets.
    """

    classes = ("hold", "slip")
    """Names of the labels."""

    def __init__(
        self,
        windows: "Windows",
        transform: Callable[[np.ndarray], Any] | None = None,
        target_transform: Callable[[int], Any] | None = None,
    ):
        self.windows, self.transform, self.target_transform = windows, transform, target_transform
        self.sensor_size = (windows.settings.width, windows.settings.height, 2)
        """Columns and rows of the crop, and polarities."""

    def __len__(self) -> int:
        return len(self.windows)

    def __getitem__(self, index: Any) -> Any:
        """A pair; or, of a slice or an index array, the pairs of these windows. Raises DataError."""
        if isinstance(index, slice) or np.ndim(index):
            return LabelledEvents(self.windows[index], self.transform, self.target_transform)
        events, label = self.windows[index].to_structured(), int(self.windows.label[index])
        if self.transform is not None:
            events = self.transform(events)
        return events, label if self.target_transform is None else self.target_transform(label)
