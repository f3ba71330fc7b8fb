"""Messages to the page: curves, picture and events since the last one."""

from typing import Any

import numpy as np

from evslip.control.controllers.controller import SlipAnswer
from evslip.control.episode import Episode
from evslip.events.stream import Events
from evslip.scene.textures.library import linear_to_srgb
from evslip.view.web.pages import event_words, packed

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

    def packed(self, episode: Episode, state: dict[str, Any]) -> bytes:
        """Curves and state, the picture (height * width bytes) and events as `event_words`; see `pages.packed`."""
        frame = episode.frame
        assert frame is not None
        picture = np.round(linear_to_srgb(np.clip(frame.luminance, 0.0, 1.0)) * 255).astype(np.uint8)
        height, width = picture.shape
        words = event_words(self.events, (width, height))
        return packed({"rows": self.rows, "size": [width, height], "events": len(words), **state}, picture, words)
