"""Settings of a conversion from frames to events. Light to import, for the command line."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any


@dataclass(frozen=True, kw_only=True)
class FrameConversion:
    """Settings of frames that are turned into events."""

    clip: Path
    """Folder of images, video file, or .npz file with the arrays frames and t_us or t_s."""
    fps: float | None = None
    """Frames a second. A folder needs this or times; a video or .npz file knows its own."""
    times: Path | None = None
    """Text file with the time of each frame, one a line, first column; a header t_us or t_s says the unit."""
    times_unit: str | None = None
    """Unit of the times where no header says it, us or s; default: us."""
    camera: str = "davis346"
    """Preset of the event camera, see `evslip show camera`."""
    mode: str = "accurate"
    """Rules of the pixels: accurate, or those of v2e to the letter (v2e)."""
    intensity: str | None = None
    """Meaning of the frames' numbers. uint8: codes of 0 to 255, mapped to log intensity as v2e does; srgb: such codes,
    decoded to light first; linear: light, white = 1 (255 for bytes). Default: linear for floats, uint8 for others."""
    interpolate: str = "linear"
    """Between two frames: linear|none|flow|rife. linear: log intensity changes evenly (in mode v2e: its events come
    evenly). none: a frame stands still until the next one comes. flow: frames brought along optical flow, for slow
    videos of fast motion; needs the extra flow. rife: frames by a neural network; needs the extra rife."""
    upsample: int = 8
    """Intervals that flow or rife make of one: 2 to 64; rife: 2, 4, 8, 16 or 32."""
    seed: int = 0
    """Seed of the noise and the mismatch."""
    parameters: dict[str, Any] = field(default_factory=dict)
    """Fields of PixelModel, in place of the preset's."""
    readout: dict[str, float] = field(default_factory=dict)
    """Fields of Readout, in place of the preset's."""
