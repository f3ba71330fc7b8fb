"""Settings of an import. Light to import, for the command line."""

from dataclasses import dataclass
from pathlib import Path

from evslip.exchange.selection import Flip, Rotation, Selection


@dataclass(frozen=True, kw_only=True)
class Importing:
    """How a recording is brought in."""

    labels: Path | None = None
    """CSV file start_s,end_s,label: seconds after the first event, slip or hold."""
    crop: tuple[int, int, int, int] | None = None
    """X, y, width and height of the pixels to keep; the corner x, y becomes 0, 0."""
    rotate: Rotation = 0
    """Turn the picture clockwise, after the crop, degrees."""
    flip: Flip | None = None
    """Mirror the picture after that: left and right (x), or top and bottom (y)."""
    frames: bool = True
    """Keep the frames, if there are any."""
    sensor: str = ""
    """Note of the sensor."""
    mount: str = ""
    """Note of how it was mounted."""
    size: tuple[int, int] | None = None
    """Width and height of the sensor where the file does not state them; default: the extent of its events, and 346 260
    for a simulator, whose frames are brought to this size."""
    camera: str | None = None
    """The camera that is brought in, such as left, of a file of several; of a simulator's folder without events the
    event camera that looks at its frames, default: davis346."""
    seed: int = 0
    """Seed of that camera."""
    centre_m: tuple[float, float, float] | None = None
    """The point between the fingers in the frame of a simulator's gripper, m; default: as the bag says, or else
    0 0 0."""

    @property
    def selection(self) -> Selection:
        """Part of the picture that is kept, and its turn."""
        return Selection(self.crop, rotate=self.rotate, flip=self.flip)
