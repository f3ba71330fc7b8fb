"""A window on the screen that shows pictures as they come."""

import os
import sys
from typing import Any

import numpy as np

from evslip.utils.errors import ConfigError


class PictureWindow:
    """A window of Matplotlib. Raises ConfigError where there is no screen."""

    def __init__(self, rate_hz: int):
        # A backend that was asked for by name, as for tests, is taken.
        headless = sys.platform.startswith("linux") and not (
            os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
        )
        if headless and not os.environ.get("MPLBACKEND"):
            raise ConfigError(
                "render_mode: 'human' needs a screen, and there is none (DISPLAY is not set); expected 'rgb_array'"
            )
        self._pause_s, self._figure, self._image = 1 / rate_hz, None, None

    def show(self, picture: np.ndarray) -> None:
        """Show a picture, uint8 of shape (height, width, 3)."""
        from matplotlib import pyplot

        if self._figure is None:
            height, width = picture.shape[:2]
            self._figure = pyplot.figure("evslip", figsize=(2 * width / 100, 2 * height / 100))
            axes = self._figure.add_axes((0, 0, 1, 1))
            axes.set_axis_off()
            self._image: Any = axes.imshow(picture)
        self._image.set_data(picture)
        self._figure.canvas.draw_idle()
        self._figure.canvas.start_event_loop(self._pause_s) if self._is_interactive() else self._figure.canvas.draw()

    def close(self) -> None:
        """Close it."""
        if self._figure is not None:
            from matplotlib import pyplot

            pyplot.close(self._figure)
            self._figure = None

    def _is_interactive(self) -> bool:
        import matplotlib

        return matplotlib.get_backend().lower() != "agg"
