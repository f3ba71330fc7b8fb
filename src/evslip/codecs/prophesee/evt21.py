"""EVT 2.1: a word of 64 bits for up to 32 events of one time, row and polarity.

After https://docs.prophesee.ai/stable/data/encoding_formats/evt21.html. The upper half is a word of EVT 2.0; the lower
half has a bit for each of the 32 pixels from its x on.
"""

import numpy as np

from evslip.codecs.prophesee import evt2
from evslip.events.stream import Events, concatenate

_BLOCK = 1 << 16
"""Words whose bits are spread out at once."""


class Decoder(evt2.Clock):
    """The events of words that come in blocks.

    endianness: "little": the lower half of a word comes first; "legacy" (IMX636): the upper half comes first.
    """

    def __init__(self, endianness: str):
        super().__init__()
        self._endianness = endianness

    def decode(self, halves: np.ndarray) -> Events:
        """The next ones, of uint32 halves of words, of shape (n, 2), in the file's order."""
        upper, lower = halves.T if self._endianness == "legacy" else halves.T[::-1]
        which, t_us = self.timed(upper)
        parts = []
        for start in range(0, len(which), _BLOCK):
            some = which[start : start + _BLOCK]
            bits = np.unpackbits(np.ascontiguousarray(lower[some]).astype("<u4").view(np.uint8), bitorder="little")
            row, pixel = np.divmod(np.flatnonzero(bits), 32)
            x, y, p = evt2.place(upper[some])
            parts.append(Events(t_us[start : start + _BLOCK][row], x[row] + pixel.astype(np.uint16), y[row], p[row]))
        return concatenate(parts)
