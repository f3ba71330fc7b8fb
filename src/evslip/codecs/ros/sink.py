"""Bags of events alone, written part by part."""

from pathlib import Path
from typing import BinaryIO

from evslip.codecs import sink
from evslip.codecs.ros.bag_writer import BagWriter
from evslip.codecs.ros.packing import EventPacker
from evslip.events.stream import Events


class Sink(sink.Sink):
    """Writes a stream; labels are lost. Raises DataError, StorageError, MissingExtraError."""

    def __init__(self, file: BinaryIO, path: Path, size: tuple[int, int]):
        super().__init__(file, path)
        self._bag = BagWriter(path)
        try:
            self._packer = EventPacker(path, size, self._bag.cdr)
        except BaseException:
            self._bag.abandon()
            raise

    def push(self, events: Events) -> None:
        for message in self._packer.push(events):
            self._bag.put(*message)

    def close(self) -> None:
        for message in self._packer.rest():
            self._bag.put(*message)
        self._bag.finish(self._file)

    def abandon(self) -> None:
        self._bag.abandon()
