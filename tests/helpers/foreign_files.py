"""Files in formats that evslip reads but does not write."""

import numpy as np

from evslip.events.stream import Events


def aedat2(events: Events, size: tuple[int, int], header: bytes = b"") -> bytes:
    """As v2e and jAER write a DAVIS's events: mirrored both ways."""
    x, y = (side - 1 - column.astype(int) for side, column in zip(size, (events.x, events.y), strict=True))
    words = np.stack([x << 12 | y << 22 | events.p.astype(int) << 11, events.t_us], 1)
    return b"#!AER-DAT2.0\r\n# made by hand\r\n" + header + words.astype(">u4").tobytes()
