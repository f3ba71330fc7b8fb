"""Pictures of what the camera sees in an episode."""

import numpy as np

from evslip.events.frame import Frame
from evslip.events.overlay import overlay
from evslip.events.stream import Events
from evslip.scene.textures.library import linear_to_srgb


def picture_of(frame: Frame | None, events: Events, size: tuple[int, int]) -> np.ndarray:
    """Events over a frame, or over white where there is none yet; uint8 of shape (height, width, 3)."""
    grey = np.full(size[::-1], 255, np.uint8)
    if frame is not None:
        grey = np.round(linear_to_srgb(np.clip(frame.luminance, 0.0, 1.0)) * 255).astype(np.uint8)
    return overlay(np.repeat(grey[..., None], 3, axis=2), events)
