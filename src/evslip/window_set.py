"""Many labelled windows, in memory and as one file."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any, Literal, NamedTuple, get_args

import h5py
import numpy as np

from evslip import atomic, hdf5
from evslip.errors import ConfigError, DataError
from evslip.frame import BODIES

HOLD, SLIP = 0, 1
LabelMode = Literal["motion", "angular", "paper"]
FORMAT, VERSION = "evslip windows", 1
OLD_BODIES = 4
"""Bodies that files of before the arm was drawn count."""


@dataclass(frozen=True)
class WindowSettings:
    """How windows are cut and labelled."""

    length_s: float = 0.16
    """Length of a window."""
    hop_s: float = 0.16
    """From one window's start to the next one's."""
    labels: LabelMode = "motion"
    """What counts. motion: how far the object turns or slides in the hand, at most, since the window's start. angular:
    how far it turns, alone (the paper). paper: how far the paper's theta has risen at the window's end (its public
    code); a fall counts as no movement, and so does a turn there and back."""
    slip_deg: float = 1.0
    """A window is slip from this rotation on ..."""
    slip_mm: float = 2.0
    """... or, by motion, from this slide on."""
    hold_deg: float = 0.1
    """A window is hold below this rotation ..."""
    hold_mm: float = 0.1
    """... and, by motion, this slide. Between hold and slip it is dropped; equal thresholds leave nothing between."""
    left: int = 73
    """First column of the crop."""
    top: int = 10
    """First row of the crop."""
    width: int = 200
    """Columns of the crop, at most 256."""
    height: int = 250
    """Rows of the crop, at most 256."""
    sensor_width: int = 346
    """Columns of the sensor that the crop is meant for; sensors of another size are aligned at their centre."""
    sensor_height: int = 260
    """Rows of that sensor."""
    balance: bool = True
    """Remove windows of the commoner label at random until both are equally many."""
    seed: int = 0
    """Seed of that removal."""

    def __post_init__(self) -> None:
        if self.labels not in get_args(LabelMode):
            raise ConfigError(f"labels {self.labels!r}: expected one of {', '.join(get_args(LabelMode))}")
        if not (0.001 <= self.length_s <= 10 and 0.001 <= self.hop_s <= 1000):
            raise ConfigError(
                f"length_s {self.length_s:g}, hop_s {self.hop_s:g}: expected 0.001 to 10 and 0.001 to 1000"
            )
        if self.hold_deg > self.slip_deg or self.hold_mm > self.slip_mm or min(self.hold_deg, self.hold_mm) < 0:
            raise ConfigError(
                f"hold_deg {self.hold_deg:g}, slip_deg {self.slip_deg:g}, hold_mm {self.hold_mm:g}, slip_mm "
                f"{self.slip_mm:g}: expected 0 <= hold <= slip"
            )
        inside = self.left + self.width <= self.sensor_width and self.top + self.height <= self.sensor_height
        if not (1 <= self.width <= 256 and 1 <= self.height <= 256 and min(self.left, self.top) >= 0 and inside):
            raise ConfigError(
                f"crop of {self.width}x{self.height} from ({self.left}, {self.top}): expected 1 to 256 columns and "
                f"rows inside the sensor of {self.sensor_width}x{self.sensor_height}"
            )


class WindowEvents(NamedTuple):
    """The events of one window in its crop, as views."""

    t_us: np.ndarray
    """Microseconds since the window's start, uint32 of shape (n,)."""
    x: np.ndarray
    """Columns in the crop, uint8 of shape (n,)."""
    y: np.ndarray
    """Rows in the crop, uint8 of shape (n,)."""
    p: np.ndarray
    """Polarity, bool of shape (n,)."""


@dataclass(frozen=True, eq=False)
class Windows:
    """Many windows: all events in four long arrays (coordinates, never dense grids), and what is known of each."""

    settings: WindowSettings
    t_us: np.ndarray
    x: np.ndarray
    y: np.ndarray
    p: np.ndarray
    offsets: np.ndarray
    """Window i has the events offsets[i] to offsets[i + 1]; int64 of shape (n + 1,)."""
    label: np.ndarray
    """HOLD or SLIP, uint8 of shape (n,)."""
    name: np.ndarray
    """Sample that each window is from, str of shape (n,); splits are made by it."""
    start_us: np.ndarray
    """Start in its sample, int64 of shape (n,)."""
    rotation_deg: np.ndarray
    """Largest rotation in the hand since the window's start, float32 of shape (n,)."""
    translation_mm: np.ndarray
    """Largest slide in the hand since the window's start, float32 of shape (n,)."""
    recent: np.ndarray
    """Whether the object moved in the 0.2 s before the window, bool of shape (n,)."""
    by_body: np.ndarray
    """Events of each body in the crop, in the order of evslip.frame.BODIES, int64 of shape (n, 5)."""
    dropped: int = 0
    """Windows whose movement lay between hold and slip."""

    def __len__(self) -> int:
        return len(self.label)

    def __getitem__(self, index: int) -> WindowEvents:
        part = slice(self.offsets[index], self.offsets[index + 1])
        return WindowEvents(self.t_us[part], self.x[part], self.y[part], self.p[part])

    def take(self, which: np.ndarray) -> "Windows":
        """The windows of an index array or mask, events copied."""
        which = np.flatnonzero(which) if which.dtype == bool else which
        parts = [self[int(i)] for i in which]
        sizes = np.array([len(part.t_us) for part in parts], np.int64)
        changed = {
            name: np.concatenate([getattr(self, name)[:0], *(getattr(part, name) for part in parts)])
            for name in WindowEvents._fields
        }
        kept = {name: getattr(self, name)[which] for name in _PER_WINDOW}
        return replace(self, **changed, **kept, offsets=np.concatenate([[0], np.cumsum(sizes)]))

    def balanced(self, seed: int = 0) -> "Windows":
        """As many holds as slips: windows of the commoner label are removed at random. With one label alone, all."""
        indices = [np.flatnonzero(self.label == label) for label in (HOLD, SLIP)]
        number = min(map(len, indices))
        if not number:
            return self
        rng = np.random.default_rng([seed, 0xBA1A])
        chosen = np.concatenate([rng.choice(which, number, replace=False) for which in indices])
        return self.take(np.sort(chosen))

    def split_by_trajectory(self, fraction: float, seed: int = 0) -> tuple["Windows", "Windows"]:
        """Two sets that share no trajectory; the second has about `fraction` of them, at least one of each kind.

        Trajectories with and without slip are divided separately, so that both labels occur on both sides. Raises
        DataError if there are too few.
        """
        names = np.unique(self.name)
        slips = np.isin(names, self.name[self.label == SLIP])
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
                counts = f"{len(names)} trajectories ({slips.sum()} with slip windows)"
                raise DataError(f"{counts} are too few to have holds and slips on both sides of a split")
        return parts

    def summary(self) -> str:
        """One line for a person."""
        slips = int((self.label == SLIP).sum())
        return (
            f"{len(self)} windows ({slips} slip, {len(self) - slips} hold, {self.dropped} between were dropped) "
            f"of {len(np.unique(self.name))} trajectories, {len(self.t_us):,} events"
        )

    def save(self, path: str | Path) -> None:
        """Write one HDF5 file, whole or not at all. Raises StorageError."""
        atomic.write_bytes(Path(path), hdf5.image(self._fill))

    def _fill(self, file: h5py.File) -> None:
        file.attrs.update({"format": FORMAT, "version": VERSION, "dropped": self.dropped, **asdict(self.settings)})
        for name, (dtype, _) in _ARRAYS.items():
            values = np.char.encode(self.name, "utf-8") if name == "name" else getattr(self, name).astype(dtype)
            hdf5.put(file, name, values)


_ARRAYS = {
    "t_us": (np.uint32, ()),
    "x": (np.uint8, ()),
    "y": (np.uint8, ()),
    "p": (np.uint8, ()),
    "offsets": (np.int64, ()),
    "label": (np.uint8, ()),
    "name": ("S", ()),
    "start_us": (np.int64, ()),
    "rotation_deg": (np.float32, ()),
    "translation_mm": (np.float32, ()),
    "recent": (np.uint8, ()),
    "by_body": (np.int64, (len(BODIES),)),
}
_PER_WINDOW = ("label", "name", "start_us", "rotation_deg", "translation_mm", "recent", "by_body")


def stored_settings(stored: Mapping[str, Any]) -> dict[str, Any]:
    """The fields of WindowSettings among stored values. Files without the mode of the labels are older than it: theirs
    is the default. Raises KeyError."""
    names = (field.name for field in fields(WindowSettings))
    return {name: stored[name] for name in names if name != "labels" or name in stored}


def load_windows(path: str | Path) -> Windows:
    """Read a file that Windows.save wrote. Raises DataError."""
    with hdf5.opened(path) as file:
        if file.attrs.get("format") != FORMAT:
            raise DataError(f"{path}: an HDF5 file, but not one that `evslip windows` wrote")
        version = hdf5.attribute(file, "version", int)
        if version != VERSION:
            raise DataError(f"{path}: version {version} of the format; this evslip reads version {VERSION}")
        values = stored_settings(file.attrs)
        plain = {name: value.item() if isinstance(value, np.generic) else value for name, value in values.items()}
        kinds = {name: np.dtype(dtype).kind for name, (dtype, _) in _ARRAYS.items()}
        tails = {name: tail for name, (_, tail) in _ARRAYS.items()}
        if isinstance(counts := file.get("by_body"), h5py.Dataset) and counts.shape[1:] == (OLD_BODIES,):
            tails["by_body"] = (OLD_BODIES,)
        arrays = {name: hdf5.get(file, name, kinds[name], (None, *tail)) for name, tail in tails.items()}
        arrays["by_body"] = np.pad(arrays["by_body"], ((0, 0), (0, len(BODIES) - tails["by_body"][0])))
        windows = Windows(WindowSettings(**plain), dropped=hdf5.attribute(file, "dropped", int), **arrays)
    return _checked(windows, path)


def _checked(windows: Windows, path: str | Path) -> Windows:
    number, events = len(windows.label), len(windows.t_us)
    lengths = np.diff(windows.offsets)
    settings = windows.settings
    right = (
        all(len(getattr(windows, name)) == number for name in _PER_WINDOW)
        and all(len(getattr(windows, name)) == events for name in ("x", "y", "p"))
        and len(windows.offsets) == number + 1
        and windows.offsets[0] == 0
        and windows.offsets[-1] == events
        and (lengths >= 0).all()
        and (windows.label <= SLIP).all()
        and windows.t_us.max(initial=0) <= settings.length_s * 1e6
        and windows.x.max(initial=0) < settings.width
        and windows.y.max(initial=0) < settings.height
    )
    if not right:
        raise DataError(f"{path}: its arrays contradict one another; make the windows again")
    names = np.char.decode(windows.name, "utf-8", "replace")
    return replace(windows, name=names, p=windows.p > 0, recent=windows.recent > 0)
