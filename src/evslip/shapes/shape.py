"""What every shape can say about itself."""

from abc import ABC, abstractmethod
from typing import Any

import numpy as np

from evslip.shapes.surface import Surface


class Shape(ABC):
    """An object's body, in its own frame: x along the width, y along the depth (between the pads), z up, origin in the
    middle of its bounding box."""

    def __init__(self, spec: Any):
        """spec: the object's section of the parameters (`schema.ObjectSpec`)."""
        self.half_m = np.array([spec.width_m, spec.depth_m, spec.height_m]) / 2
        """Half the bounding box's sides, of shape (3,)."""

    @abstractmethod
    def surface(self) -> Surface:
        """What it looks like."""
