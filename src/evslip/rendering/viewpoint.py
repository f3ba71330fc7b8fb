"""Poses of camera and object when a picture is taken."""

from typing import NamedTuple

import numpy as np


class View(NamedTuple):
    """Camera and object at one instant, in the world."""

    camera: np.ndarray
    """Position in metres, of shape (3,)."""
    turn: np.ndarray
    """The camera's axes as columns: right, up, backward; of shape (3, 3)."""
    focal: float
    """In pixels."""
    place: np.ndarray
    """The object's position, of shape (3,)."""
    axes: np.ndarray
    """Its axes as columns, of shape (3, 3)."""
