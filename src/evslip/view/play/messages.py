"""Messages to the page: curves, picture and events since the last one."""

import json
import struct
from typing import Any

import numpy as np

from evslip.control.controllers.controller import SlipAnswer
from evslip.control.episode import Episode
from evslip.events.stream import Events
from evslip.scene.textures.library import linear_to_srgb

MOST_EVENTS = 30_000
"""Events in a message; of more, the newest."""
CURVES = ("t_s", "p_slip", "found_deg_s", "true_deg_s", "found_mm_s", "true_mm_s", "force_n", "least_n", "theta_deg")
"""Columns of the curves."""


class Message:
    """Events and curves since the last message."""

    def __init__(self, since_us: int):
        self.since_us = since_us
        self.rows: list[list[float | None]] = []
        self.events: list[Events] = []

    def take(self, episode: Episode, answer: SlipAnswer, has_speeds: bool) -> None:
        """Take what a step has brought. has_speeds: whether the detector estimates them."""
        monitor, truth = episode.monitor, episode.truth
        turning, sliding = monitor.speeds()
        found = (answer.rotation_deg_s, answer.slide_mm_s) if has_speeds else (None, None)
        row = [
            (episode.t_us - episode.start_us) / 1e6, answer.p_slip, found[0], turning, found[1], sliding,
            episode.simulation.force_n, truth.least_n, monitor.theta_deg,
        ]  # fmt: skip
        self.rows.append([None if value is None else round(float(value), 4) for value in row])
        self.events.append(episode.events)


def message(shown: Message, episode: Episode, state: dict[str, Any]) -> bytes:
    """Length of the head as uint32, the head as JSON, the picture (height * width bytes), and events as uint32: x in
    bits 0 to 11, y in 12 to 23, polarity in bit 24. All little-endian."""
    x, y, p = (np.concatenate([getattr(part, name) for part in shown.events]) for name in "xyp")
    words = x.astype(np.uint32) | y.astype(np.uint32) << 12 | p.astype(np.uint32) << 24
    words, frame = words[-MOST_EVENTS:], episode.frame
    assert frame is not None
    picture = np.round(linear_to_srgb(np.clip(frame.luminance, 0.0, 1.0)) * 255).astype(np.uint8)
    height, width = picture.shape
    head = {"rows": shown.rows, "size": [width, height], "events": len(words), "fired": len(x), **state}
    text = json.dumps(head).encode()
    text += b" " * (-len(text) % 4)
    return b"".join([struct.pack("<I", len(text)), text, picture.tobytes(), words.astype("<u4").tobytes()])
