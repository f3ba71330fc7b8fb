"""Records of several data sets in a row, under names that keep the sets apart."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from evslip.data.record import Record
from evslip.data.samples import Samples
from evslip.utils.errors import ConfigError
from evslip.utils.files import printable

SEPARATOR = ":"


class Mixture:
    """Records of all sets, each named <folder>:<name>, so that trajectories of different sets never count as one.
    Those of a single set keep their names. Raises ConfigError for a set that is given twice."""

    def __init__(self, sets: Sequence[Samples]):
        self._sets, self._names = sets, set_names([samples.root for samples in sets])

    def __iter__(self) -> Iterator[Record]:
        return self._named(self._sets)

    def without_events(self) -> Iterator[Record]:
        """All records, quicker to read, their streams empty. Raises DataError."""
        return self._named([samples.without_events() for samples in self._sets])

    def _named(self, sets: Sequence[Iterable[Record]]) -> Iterator[Record]:
        for name, records in zip(self._names, sets, strict=True):
            for record in records:
                yield record if len(sets) == 1 else replace(record, name=f"{name}{SEPARATOR}{record.name}")


def set_names(roots: Sequence[Path]) -> list[str]:
    """Names of the folders or files; a name that is there already gets a number. Raises ConfigError."""
    names: list[str] = []
    whole = [root.resolve() for root in roots]
    for number, path in enumerate(whole):
        if path in whole[:number]:
            raise ConfigError(f"{roots[number]}: given twice; expected different data sets")
        name = printable(path.stem if path.is_file() else path.name)
        same = (f"{name}-{n}" for n in range(2, len(roots) + 2))
        names.append(name if name not in names else next(other for other in same if other not in names))
    return names


def plain_name(name: str) -> str:
    """Name of a record without that of its set."""
    return name.rpartition(SEPARATOR)[2]
