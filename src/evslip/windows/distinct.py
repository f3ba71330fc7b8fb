"""Records that come but once: one that came twice could lie on both sides of a split, and flatter a detector."""

import zlib

import numpy as np

from evslip.data.record import Record
from evslip.utils.errors import DataError


class Distinct:
    """Remembers the names and the contents of records."""

    def __init__(self) -> None:
        self._names: set[tuple[str, str]] = set()
        self._contents: dict[object, str] = {}

    def add(self, record: Record) -> None:
        """Take a record. Raises DataError for one whose name or content another one had."""
        name = record.name, record.camera
        if name in self._names:
            raise DataError(
                f"{record.name}: two records have this name; expected each once, and a name of its own: import "
                "it again from a file of another name"
            )
        content = _content(record)
        if content is not None and content in self._contents:
            raise DataError(
                f"{record.name}: is {self._contents[content]} once more; expected each record once, also among several "
                "data sets"
            )
        self._names.add(name)
        self._contents[content] = record.name


def _content(record: Record) -> object:
    """Identity of what a record holds: the parameters of a sample, the events of a recording; None for neither."""
    if record.params is not None:
        return record.params.model_dump_json()
    if not record.events.count:
        return None
    sums = tuple(zlib.crc32(column.data) for column in map(np.ascontiguousarray, record.events.columns))
    return record.events.count, sums
