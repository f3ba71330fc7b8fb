"""Records that belong together, wherever they come from."""

from abc import ABC, abstractmethod
from collections.abc import Container, Iterator, Sequence
from copy import copy
from operator import index
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, Self, SupportsIndex, overload

from evslip.data import record_file
from evslip.data.journal import Entry
from evslip.data.record import Record
from evslip.data.record_file import ALL_CAMERAS
from evslip.utils.errors import ConfigError

if TYPE_CHECKING:
    from evslip.windows.window_set import Windows, WindowSettings


class Listing(NamedTuple):
    """A record, without reading it."""

    path: Path
    name: str
    split: str = ""
    """Empty for a recording."""
    label: str | None = None
    """slip or hold; None: only its file knows."""
    events: int | None = None
    """Number of events; None: only its file knows."""
    sha256: str | None = None
    """Sum of the file as it was written; None where nobody knows."""
    camera: str | None = None
    """Camera whose stream is meant; None: the only one, or not chosen yet."""


class Samples(ABC):
    """Records of one place, read when asked for: len(), [i] and iteration."""

    root: Path
    listing: Sequence[Listing]
    """All records, in order."""
    splits: tuple[str, ...] = ()
    """Splits that the records are divided into, if they are."""
    config_toml: str = ""
    """Text of the configuration that the samples are drawn from, if they are drawn."""
    rejections: Sequence[Entry] = ()
    """Samples whose motion or grasp failed, with the reason in entry["rejection"]."""

    @abstractmethod
    def labels(self) -> list[str]:
        """slip, hold or, of recordings, unlabelled, of each record."""

    @abstractmethod
    def status(self) -> dict[str, int]:
        """Counts of samples, events and bytes.

        `requested` is the plan plus what was made beyond it, `done` includes the rejected ones, `missing` is the rest.
        """

    def split(self, name: str) -> "Samples":
        """The part of one split. Raises DataError, or ConfigError where there are none."""
        raise ConfigError(f"split: {self.root} holds recordings, which are in no split")

    def read(self, position: int, events: bool = True) -> Record:
        """One record; events=False is quicker and leaves its stream empty. Raises DataError, IndexError."""
        listed = self.listing[position]
        return record_file.read(listed.path, events, listed.camera)

    def seen_by(self, camera: str | None) -> Self:
        """The records as one of their cameras saw them, or once as each of them did for ALL_CAMERAS; None: as they
        are. Raises DataError, also when a record is read that has no such camera."""
        if camera is None:
            return self
        listing = []
        for one in self.listing:
            cameras = self.cameras(one) or (None,) if camera == ALL_CAMERAS else (camera,)
            listing += [one if name is None else one._replace(camera=name, events=None) for name in cameras]
        return self._listing(listing)

    def cameras(self, one: Listing) -> tuple[str, ...]:
        """Names of a record's cameras if it has several. Raises DataError."""
        return record_file.camera_names_in(one.path)

    def positions(self, names: Container[str]) -> list[int]:
        """Positions of the records of some names."""
        return [position for position, listed in enumerate(self.listing) if listed.name in names]

    def __len__(self) -> int:
        return len(self.listing)

    @overload
    def __getitem__(self, position: SupportsIndex) -> Record: ...
    @overload
    def __getitem__(self, position: slice) -> Self: ...
    def __getitem__(self, position: SupportsIndex | slice) -> "Record | Self":
        return self._listing(self.listing[position]) if isinstance(position, slice) else self.read(index(position))

    def _listing(self, listing: Sequence[Listing]) -> Self:
        """The same with other records."""
        chosen = copy(self)
        chosen.listing = listing
        return chosen

    def __iter__(self) -> Iterator[Record]:
        return (self.read(position) for position in range(len(self)))

    def without_events(self) -> Iterator[Record]:
        """All records, quicker to read, their streams empty. Raises DataError."""
        return (self.read(position, events=False) for position in range(len(self)))

    def windows(self, settings: "WindowSettings | None" = None) -> "Windows":
        """Labelled windows of all records. Raises DataError."""
        # The one import that climbs: windows are cut from records, and users ask the records for them.
        from evslip.windows.cutting import windows_of

        return windows_of(self, settings)
