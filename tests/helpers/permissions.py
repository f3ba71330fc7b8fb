"""Processes that permissions bind."""

import ctypes
import os


def powerless() -> None:
    """Root gives up, for what this process executes, that permissions do not bind it."""
    if os.geteuid() == 0:
        ctypes.CDLL(None).prctl(24, 1, 0, 0, 0)  # CAP_DAC_OVERRIDE leaves the bounding set
