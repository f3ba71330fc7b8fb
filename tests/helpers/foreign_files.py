"""Files in formats, or of kinds of them, that evslip reads but does not write."""

import struct
from typing import NamedTuple

import numpy as np

from evslip.codecs.inivation.aedat4_sink import EVENT, MAGIC
from evslip.codecs.inivation.flatbuffer import Vector, buffer
from evslip.events.stream import Events


def aedat2(events: Events, size: tuple[int, int], header: bytes = b"") -> bytes:
    """As v2e and jAER write a DAVIS's events: mirrored both ways."""
    x, y = (side - 1 - column.astype(int) for side, column in zip(size, (events.x, events.y), strict=True))
    words = np.stack([x << 12 | y << 22 | events.p.astype(int) << 11, events.t_us], 1)
    return b"#!AER-DAT2.0\r\n# made by hand\r\n" + header + words.astype(">u4").tobytes()


class Camera(NamedTuple):
    """A camera of an AEDAT4 file of several."""

    name: str
    size: tuple[int, int]
    events: Events
    images: tuple[np.ndarray, ...] = ()
    """Grey, a microsecond apart."""


def aedat4(*cameras: Camera) -> bytes:
    """As dv-processing's StereoCameraWriter has it, but not packed: frames first, then the events of each camera."""
    nodes, packets = "", b""
    for number, (name, size, events, images) in enumerate(cameras):
        rows = np.zeros(len(events), EVENT)
        for column, values in zip(("t", "x", "y", "on"), events.columns, strict=True):
            rows[column] = values
        streams = {
            "FRME": [_frame(image, t_us) for t_us, image in enumerate(images)],
            "EVTS": [buffer(b"EVTS", Vector(len(rows), rows.tobytes()))],
        }
        for place, (kind, contents) in enumerate(streams.items()):
            stream = 2 * number + place
            nodes += f"""<node name="{stream}"><attr key="typeIdentifier">{kind}</attr><node name="info">
                <attr key="sizeX">{size[0]}</attr><attr key="sizeY">{size[1]}</attr>
                <attr key="source">{name}</attr></node></node>"""
            packets += b"".join(struct.pack("<iI", stream, len(content)) + content for content in contents)
    text = f"""<dv><node name="outInfo">{nodes}</node></dv>""".encode()
    header = buffer(b"IOHE", struct.pack("<i", 0), struct.pack("<q", -1), Vector(len(text), text + b"\0"))
    return MAGIC + header + packets


def _frame(image: np.ndarray, t_us: int) -> bytes:
    """Of a frame's 11 fields those that evslip reads; the others are there, too, of 4 bytes."""
    height, width = image.shape
    fields: list[bytes | Vector] = [bytes(4)] * 10
    fields[0], fields[6], fields[7] = (struct.pack("<q", number) for number in (t_us, width, height))
    return buffer(b"FRME", *fields, Vector(image.size, image.tobytes()))
