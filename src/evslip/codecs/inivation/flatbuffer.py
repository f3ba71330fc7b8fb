"""Flatbuffers (https://flatbuffers.dev/internals/): tables of damaged files are read safely, simple ones are made."""

import struct
from typing import NamedTuple


class Table(NamedTuple):
    """A table of a flatbuffer, every offset checked: ValueError or struct.error."""

    data: memoryview
    position: int

    @classmethod
    def root(cls, data: memoryview, identifier: bytes) -> "Table":
        """The table that a buffer holds."""
        if data[4:8] != identifier:
            raise ValueError(f"expected a packet {identifier.decode()}, found {bytes(data[4:8])!r}")
        return cls(data, cls(data, 0)._unpack("<I", 0))

    def number(self, field: int, layout: str, default: int) -> int:
        """A number, `layout` as for struct."""
        offset = self._offset(field)
        return self._unpack(layout, self.position + offset) if offset else default

    def vector(self, field: int, item_bytes: int) -> memoryview:
        """The bytes of a vector or a string; empty if absent."""
        start, length = self._span(field, item_bytes)
        return self.data[start : start + length]

    def tables(self, field: int) -> "list[Table]":
        """The tables of a vector of tables; none if it is absent."""
        start, length = self._span(field, 4)
        return [Table(self.data, at + self._unpack("<I", at)) for at in range(start, start + length, 4)]

    def _span(self, field: int, item_bytes: int) -> tuple[int, int]:
        """Where the items of a vector begin, and their bytes; 0, 0 if it is absent."""
        offset = self._offset(field)
        if not offset:
            return 0, 0
        start = self.position + offset
        start += self._unpack("<I", start)
        length = self._unpack("<I", start) * item_bytes
        if start + 4 + length > len(self.data):
            raise ValueError("a vector runs past the end of its packet")
        return start + 4, length

    def _offset(self, field: int) -> int:
        table = self.position - self._unpack("<i", self.position)
        known = (self._unpack("<H", table) - 4) // 2
        return self._unpack("<H", table + 4 + 2 * field) if field < known else 0

    def _unpack(self, layout: str, position: int) -> int:
        # struct would count a negative position from the end.
        if position < 0:
            raise ValueError("an offset points before its packet")
        return struct.unpack_from(layout, self.data, position)[0]


class Vector(NamedTuple):
    """A vector, or a string, for `buffer`."""

    length: int
    data: bytes
    """The items; for items that are offsets, what they lead to may follow."""


def buffer(identifier: bytes, *fields: bytes | Vector) -> bytes:
    """A buffer of one table, after its length. A field is a number's 4 or 8 bytes, or a vector, whose items will lie at
    a multiple of 8 bytes from the start."""
    vtable_bytes = 4 + 2 * len(fields)
    # Where the table begins: 4 bytes before a multiple of 8, so that its numbers lie on one; numbers of 4 come last.
    start = 12 + vtable_bytes + -(12 + vtable_bytes + 4) % 8
    order = sorted(range(len(fields)), key=lambda i: -_inline_bytes(fields[i]))
    offsets, position = [0] * len(fields), 4
    for i in order:
        offsets[i], position = position, position + _inline_bytes(fields[i])
    inline, tail = bytearray(position), b""
    struct.pack_into("<i", inline, 0, start - 12)
    for i, field in enumerate(fields):
        if isinstance(field, Vector):
            place = start + position + len(tail)
            padding = -(place + 4) % 8
            struct.pack_into("<I", inline, offsets[i], place + padding - (start + offsets[i]))
            tail += bytes(padding) + struct.pack("<I", field.length) + field.data
        else:
            inline[offsets[i] : offsets[i] + len(field)] = field
    vtable = struct.pack(f"<{2 + len(fields)}H", vtable_bytes, position, *offsets)
    content = struct.pack("<I", start - 4) + identifier + vtable.ljust(start - 12, b"\0") + inline + tail
    return struct.pack("<I", len(content)) + content


def _inline_bytes(field: bytes | Vector) -> int:
    return 4 if isinstance(field, Vector) else len(field)
