"""Counts that one could know from exact frames alone, which bound what straight lines between frames can give."""

import numpy as np

from evslip.events.stream import Events
from evslip.learn.realism.cells import Cells


def frame_counts(events: Events, frames_us: np.ndarray, cells: Cells) -> np.ndarray:
    """Counts of an oracle that knows the real events as far as frames can show them, of the shape of the cells.

    Two frames show how much the log intensity of a pixel has changed between them: ON less OFF events. The oracle
    knows this difference of every pixel and interval exactly, thresholds and all; it gives as many events of its sign,
    evenly over the interval. It does not know events that cancel each other between two frames.
    """
    width, height = cells.size
    pixels = width * height
    edges_us = np.unique(np.concatenate([[cells.start_us], frames_us, [cells.end_us]]))
    edges_us = edges_us[(edges_us >= cells.start_us) & (edges_us <= cells.end_us)]
    found = np.zeros(cells.shape)
    _, steps, rows, columns = cells.shape
    for start_us, end_us in zip(edges_us[:-1].tolist(), edges_us[1:].tolist(), strict=True):
        part = events.between(start_us, end_us)
        place = part.y.astype(np.int64) * width + part.x
        net = np.bincount(place, np.where(part.p, 1.0, -1.0), pixels).reshape(height, width)
        signed = np.stack([np.maximum(-net, 0), np.maximum(net, 0)])
        filled = np.pad(signed, ((0, 0), (0, -height % cells.pixels), (0, -width % cells.pixels)))
        gathered = filled.reshape(2, rows, cells.pixels, columns, cells.pixels).sum((2, 4))
        first, last = (start_us - cells.start_us) // cells.step_us, (end_us - 1 - cells.start_us) // cells.step_us
        for step in range(first, min(last, steps - 1) + 1):
            begin_us = cells.start_us + step * cells.step_us
            shared_us = min(end_us, begin_us + cells.step_us) - max(start_us, begin_us)
            found[:, step] += gathered * (shared_us / (end_us - start_us))
    return found
