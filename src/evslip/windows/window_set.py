"""Many labelled windows, in memory and as one file."""

import math
import zlib
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, SupportsIndex, overload

import h5py
import numpy as np

from evslip.events.frame import BODIES
from evslip.utils import atomic, hdf5
from evslip.utils.errors import ConfigError, DataError
from evslip.windows.label import Label
from evslip.windows.labelled_events import LabelledEvents
from evslip.windows.object_events import ObjectEvents
from evslip.windows.settings import WindowSettings, stored_settings
from evslip.windows.window_events import WindowEvents, pixel_dtype, unpack

__all__ = ["WindowEvents", "WindowSettings", "Windows", "open_windows"]

FORMAT = "evslip windows"
VERSIONS = {2: np.dtype(np.uint8), 3: np.dtype(np.uint16)}
"""Versions of the format, with the dtype of packed events; 3 is for crops of more than 256 columns or rows."""
MAP_PX = 16
"""Side of the parts of the picture in which the object's events are counted."""


@dataclass(frozen=True, eq=False)
class Windows:
    """Many windows: what is known of each, and all events, packed, in memory or where they lie in a file."""

    settings: WindowSettings
    packed: np.ndarray
    """Entries of `evslip.windows.window_events.pack`, of shape (m, 3), possibly mapped from a file."""
    first: np.ndarray
    """Window i has the entries first[i] to last[i]; int64 of shape (n,)."""
    last: np.ndarray
    events: np.ndarray
    """How many events each window has, int64 of shape (n,)."""
    checksum: np.ndarray
    """CRC-32 of each window's entries, uint32 of shape (n,)."""
    label: np.ndarray
    """Label.HOLD or Label.SLIP, uint8 of shape (n,)."""
    name: np.ndarray
    """Sample that each window is from, str of shape (n,); splits are made by it."""
    start_us: np.ndarray
    """Start in its sample, int64 of shape (n,)."""
    rotation_deg: np.ndarray
    """Largest rotation in the hand since the start of the part that counts for the label
    (`WindowSettings.labelled_s`), float32 of shape (n,); nan where a person labelled."""
    translation_mm: np.ndarray
    """Largest slide in the hand, likewise."""
    rotation_speed_deg_s: np.ndarray
    """Speed at which the object turns in the hand, mean of the window's last 20 ms, float32 of shape (n,); nan where a
    person labelled, and in files from before it was kept."""
    slide_speed_mm_s: np.ndarray
    """Speed at which it slides in the hand, likewise."""
    recent: np.ndarray
    """Whether the object moved in the 0.2 s before the window, bool of shape (n,)."""
    by_body: np.ndarray
    """Events of each body in the crop, in the order of evslip.events.frame.BODIES, int64 of shape (n, 5)."""
    object_map: np.ndarray
    """The object's events in parts of 16 x 16 pixels, at most 65,535; uint16 of shape (n, rows, columns)."""
    dropped: int = 0
    """Windows whose movement lay between hold and slip."""
    object_events: ObjectEvents | None = None
    """Which events are the object's; None of recordings, and in files from before it was kept."""

    def __len__(self) -> int:
        return len(self.label)

    @overload
    def __getitem__(self, index: SupportsIndex) -> WindowEvents: ...
    @overload
    def __getitem__(self, index: slice | np.ndarray) -> "Windows": ...
    def __getitem__(self, index: Any) -> "WindowEvents | Windows":
        """The events of a window, or some of the windows, as `take`. Raises DataError if they are damaged."""
        if isinstance(index, slice) or np.ndim(index):
            return self.take(index)
        entries = self.packed[self.first[index] : self.last[index]]
        whole = zlib.crc32(entries.data) == self.checksum[index]
        events = unpack(entries, int(self.events[index])) if whole else None
        width, height = self.settings.width, self.settings.height
        if events is None or events.x.max(initial=0) >= width or events.y.max(initial=0) >= height:
            where = f"{self.name[index]}, {self.start_us[index]} us"
            raise DataError(f"the events of window {index} ({where}) are damaged; make the windows again")
        return events

    def __getstate__(self) -> dict[str, Any]:
        # Another process maps the file again: it gets no copy of the events.
        packed = self.packed
        if not isinstance(packed, np.memmap):
            return self.__dict__
        return self.__dict__ | {"packed": (str(packed.filename), packed.dtype, "r", packed.offset, packed.shape)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        if isinstance(state["packed"], tuple):
            with atomic.storage_errors(state["packed"][0]):
                self.__dict__["packed"] = np.memmap(*state["packed"])

    def labelled_events(
        self,
        transform: Callable[[np.ndarray], Any] | None = None,
        target_transform: Callable[[int], Any] | None = None,
    ) -> LabelledEvents:
        """The windows as tonic's data sets give theirs: pairs of a structured array and a label."""
        return LabelledEvents(self, transform, target_transform)

    def take(self, which: slice | np.ndarray) -> "Windows":
        """The windows of a slice, an index array or a mask. Their events stay where they are."""
        some = replace(self, **{name: getattr(self, name)[which] for name in _PER_WINDOW})
        return some if self.object_events is None else replace(some, object_events=self.object_events.take(which))

    def balanced(self, seed: int = 0, ratio: float = 1.0) -> "Windows":
        """Windows of which the commoner label has at most `ratio` for each of the rarer one, the others removed at
        random; all of one label alone. Raises ConfigError for a ratio that is not above 0 and finite."""
        chosen = balanced_choice(self.label, seed, ratio)
        return self if len(chosen) == len(self) else self.take(chosen)

    def split_by_trajectory(self, fraction: float, seed: int = 0) -> tuple["Windows", "Windows"]:
        """Two sets that share no trajectory; the second has about `fraction` of them, at least one of each kind.

        Trajectories with and without slip are divided separately, so that both labels occur on both sides. Raises
        DataError if there are too few, ConfigError for a fraction that is not between 0 and 1.
        """
        if not 0 < fraction < 1:  # nan is not, either
            raise ConfigError(f"fraction {fraction:g}: expected more than 0 and less than 1")
        names = np.unique(self.name)
        slips = np.isin(names, self.name[self.label == Label.SLIP])
        rng = np.random.default_rng([seed, 0x5911])
        second: list[str] = []
        for group in (names[slips], names[~slips]):
            if len(group):
                number = max(1, round(fraction * len(group))) if len(group) > 1 else 0
                second += rng.permutation(group)[:number].tolist()
        side = np.isin(self.name, second)
        parts = self.take(~side), self.take(side)
        for part in parts:
            if len(np.unique(part.label)) < 2:
                self._require_both_labels()
                counts = f"{len(names)} trajectories ({slips.sum()} with slip windows)"
                raise DataError(f"{counts} are too few to have holds and slips on both sides of a split")
        return parts

    def split_as_paper(self, fold: int = 0) -> tuple["Windows", "Windows"]:
        """Two sets of windows, the second a fifth of either label, whichever trajectories they are from.

        The splits of the paper's public code: five stratified folds, shuffled, with seed 100 (scikit-learn's
        StratifiedKFold), over the holds and then the slips. Windows of one simulation are alike and come to lie on both
        sides, so the scores are too good. Raises DataError for fewer than five windows of a label, ConfigError for a
        fold other than 0 to 4.
        """
        if fold not in range(5):
            raise ConfigError(f"fold {fold}: expected 0, 1, 2, 3 or 4")
        self._require_both_labels()
        order = np.argsort(self.label, kind="stable")
        (holds, slips), rng = np.bincount(self.label, minlength=2), np.random.RandomState(100)
        if min(holds, slips) < 5:
            raise DataError(f"{holds} hold and {slips} slip windows: expected at least 5 of either")
        folds = np.empty(len(self), np.int64)
        for label in (Label.HOLD, Label.SLIP):
            # The i-th fold has every fifth of the sorted labels from the i-th on.
            sizes = [(self.label[order][first::5] == label).sum() for first in range(5)]
            own = np.arange(5).repeat(sizes)
            rng.shuffle(own)
            folds[order[self.label[order] == label]] = own
        return self.take(folds != fold), self.take(folds == fold)

    def _require_both_labels(self) -> None:
        slips = int((self.label == Label.SLIP).sum())
        if slips in (0, len(self)):
            only, missing = ("hold", "slip") if not slips else ("slip", "hold")
            raise DataError(f"all {len(self)} windows are of the label {only}; training needs {missing} windows, too")

    def summary(self) -> str:
        slips = int((self.label == Label.SLIP).sum())
        return (
            f"{len(self)} windows ({slips} slip, {len(self) - slips} hold, {self.dropped} between were dropped) "
            f"of {len(np.unique(self.name))} trajectories, {self.events.sum():,} events"
        )

    def save(self, path: str | Path) -> None:
        """Write one HDF5 file, whole or not at all. Raises StorageError."""
        hdf5.write(Path(path), self._fill)

    def _fill(self, file: h5py.File) -> None:
        dtype = pixel_dtype(self.settings.width, self.settings.height)
        version = next(version for version, packed in VERSIONS.items() if packed == dtype)
        file.attrs.update({"format": FORMAT, "version": version, "dropped": self.dropped, **asdict(self.settings)})
        ends = np.cumsum(self.last - self.first)
        changed = {"last": ends, "first": ends - (self.last - self.first), "name": np.char.encode(self.name, "utf-8")}
        for name, (kind, _) in _ARRAYS.items():
            values = changed.get(name, getattr(self, name))
            hdf5.put(file, name, values if name == "name" else values.astype(kind))
        if self.object_events is not None:
            self.object_events.fill(file, self.events)
        # Neither in pieces nor compressed: so it can be mapped into memory.
        packed = file.create_dataset("packed", (int(ends[-1]) if len(ends) else 0, 3), dtype)
        for i, end in enumerate(ends):
            if self.last[i] > self.first[i]:
                packed[end - (self.last[i] - self.first[i]) : end] = self.packed[self.first[i] : self.last[i]]


_ARRAYS = {
    "first": (np.int64, ()),
    "last": (np.int64, ()),
    "events": (np.int64, ()),
    "checksum": (np.uint32, ()),
    "label": (np.uint8, ()),
    "name": ("S", ()),
    "start_us": (np.int64, ()),
    "rotation_deg": (np.float32, ()),
    "translation_mm": (np.float32, ()),
    "rotation_speed_deg_s": (np.float32, ()),
    "slide_speed_mm_s": (np.float32, ()),
    "recent": (np.uint8, ()),
    "by_body": (np.int64, (len(BODIES),)),
    "object_map": (np.uint16, (None, None)),
}
_PER_WINDOW = tuple(_ARRAYS)
_SPEEDS = ("rotation_speed_deg_s", "slide_speed_mm_s")
"""Arrays that files from before have not."""


def open_windows(path: str | Path) -> Windows:
    """Read a file that Windows.save wrote; events stay in it until they are asked for. Raises DataError."""
    with hdf5.opened(path) as file:
        if file.attrs.get("format") != FORMAT:
            raise DataError(f"{path}: an HDF5 file, but not one that `evslip windows` wrote")
        version = hdf5.attribute(file, "version", int)
        if version not in VERSIONS:
            known = " and ".join(map(str, VERSIONS))
            raise DataError(
                f"{path}: version {version} of the format; this evslip reads versions {known}: make the windows again"
            )
        settings = stored_settings(file.attrs, path)
        kinds = {name: np.dtype(dtype).kind for name, (dtype, _) in _ARRAYS.items()}
        there = [name for name in _ARRAYS if name in file or name not in _SPEEDS]
        arrays: dict[str, Any] = {name: hdf5.get(file, name, kinds[name], (None, *_ARRAYS[name][1])) for name in there}
        unknown = np.full(len(arrays["label"]), np.nan, np.float32)
        arrays |= {name: unknown for name in _SPEEDS if name not in there}
        objects = ObjectEvents.read(file, arrays["events"], settings)
        packed = hdf5.mapped(file, "packed", VERSIONS[version], (None, 3))
        windows = Windows(settings, packed, dropped=hdf5.attribute(file, "dropped", int), **arrays)
    return replace(_checked(windows, path), object_events=objects)


def require_replaceable(path: Path) -> None:
    """Raise DataError for a file that is there, not empty, and holds no windows, such as a record or a text: it is not
    to be lost."""
    if path.is_file() and path.stat().st_size and not _holds_windows(path):
        raise DataError(f"{path}: is there already, and no file of windows; give the new one another name")


def _holds_windows(path: Path) -> bool:
    """Whether a file says that `evslip windows` wrote it. Raises DataError for a damaged one."""
    if not h5py.is_hdf5(path):
        return False
    with hdf5.opened(path) as file:
        return file.attrs.get("format") == FORMAT


def _checked(windows: Windows, path: str | Path) -> Windows:
    number, entries = len(windows.label), len(windows.packed)
    right = (
        all(len(getattr(windows, name)) == number for name in _PER_WINDOW)
        and (windows.first >= 0).all()
        and (windows.first <= windows.last).all()
        and (windows.last <= entries).all()
        and (windows.events >= 0).all()
        and (windows.events <= windows.last - windows.first).all()
        and (windows.label <= Label.SLIP).all()
        and windows.object_map.shape[1:] == windows.settings.cells(MAP_PX)
        and windows.packed.dtype == pixel_dtype(windows.settings.width, windows.settings.height)
    )
    if not right:
        raise DataError(f"{path}: its arrays contradict one another; make the windows again")
    _check_movement(windows, path)
    names = np.char.decode(windows.name, "utf-8", "replace")
    return replace(windows, name=names, recent=windows.recent > 0)


def _check_movement(windows: Windows, path: str | Path) -> None:
    """Raise DataError unless the movement of each window is known, or left to a person's label."""
    for pair in (("rotation_deg", "translation_mm"), _SPEEDS):
        for name, other in (pair, pair[::-1]):
            values, lone = getattr(windows, name), ~np.isnan(getattr(windows, other))
            wrong = np.flatnonzero((np.isnan(values) & lone) | np.isinf(values) | (values < 0))
            if len(wrong):
                raise DataError(
                    f"{path}: {name}: {values[wrong[0]]} of window {wrong[0]}; expected 0 or more, or nan in it and "
                    f"in {other} where nobody knows"
                )
    if (windows.by_body < 0).any() or (np.abs(windows.start_us) > 2**62).any():
        raise DataError(f"{path}: by_body or start_us: out of range; make the windows again")


def balanced_choice(label: np.ndarray, seed: int, ratio: float) -> np.ndarray:
    """Positions, in order, of the labels (n,) that stay: at most `ratio` of the commoner for each of the rarer. Where
    there is but one label, all; else at least one of each. Raises ConfigError."""
    if not 0 < ratio < math.inf:  # nan is not, either
        raise ConfigError(f"ratio {ratio:g}: expected more than 0, and finite")
    indices = [np.flatnonzero(label == one) for one in (Label.HOLD, Label.SLIP)]
    rarer = min(map(len, indices))
    if not rarer:
        return np.arange(len(label))
    number = max(1, round(min(ratio * rarer, len(label))))
    rng = np.random.default_rng([seed, 0xBA1A])
    return np.sort(np.concatenate([rng.choice(which, min(number, len(which)), replace=False) for which in indices]))
