"""Pictures of moments: real events above, simulated ones below, on one scale."""

import numpy as np

from evslip.events.overlay import OFF_COLOR, ON_COLOR
from evslip.events.stream import Events
from evslip.learn.realism.realism import Pair
from evslip.view.pictures.images import data_uri

MOMENT_US = 40_000
MOMENTS, COLUMNS = 6, 3
FULL = 3.0
"""Events of a pixel in a moment from which on its colour is full."""


def moments_us(pair: Pair) -> list[int]:
    """Starts of the moments that are shown, evenly over the stretch."""
    number = max(1, min(MOMENTS, (pair.end_us - pair.start_us) // MOMENT_US))
    last_us = max(pair.start_us, pair.end_us - MOMENT_US)
    return [round(time) for time in np.linspace(pair.start_us, last_us, number)]


def picture(events: Events, size: tuple[int, int]) -> np.ndarray:
    """Events on white, uint8 of shape (height, width, 3): red what is more ON, blue what is more OFF."""
    width, height = size
    place = events.y.astype(np.int64) * width + events.x
    numbers = [np.bincount(place[events.p == p], minlength=width * height) for p in (False, True)]
    strength = np.minimum((numbers[0] + numbers[1]) / FULL, 1.0)[:, None]
    colour = np.where((numbers[1] >= numbers[0])[:, None], ON_COLOR, OFF_COLOR)
    return np.rint(255 + strength * (colour - 255.0)).astype(np.uint8).reshape(height, width, 3)


def strip(pair: Pair) -> str:
    """HTML of the moments: a column each, real, simulated and, where there are frames, the nearest one."""
    columns = []
    for start_us in moments_us(pair):
        images = [
            picture(events.between(start_us, start_us + MOMENT_US), pair.size) for events in (pair.real, pair.simulated)
        ]
        names = ["real", "simulated"]
        if pair.footage is not None:
            images.append(pair.footage.at(start_us + MOMENT_US // 2))
            names.append("frame")
        shown = "".join(
            f'<img src="{data_uri(image)}" alt="{name}" title="{name}" style="border: 1px solid #8a8f98">'
            for name, image in zip(names, images, strict=True)
        )
        columns.append(f"<figure>{shown}<figcaption>{start_us / 1e6:.3f} s</figcaption></figure>")
    return f'<div class="strip">{"".join(columns)}</div>'
