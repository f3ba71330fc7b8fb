"""Parameters of the rendering."""

from typing import Annotated, Generic, Literal

from pydantic import Strict

from evslip.config.section import LATER, N, S, Section, Within

RendererName = Literal["raycast", "pathtrace"]
"""`rendering.RENDERERS` says what each is."""


class RenderSpec(Section, Generic[N, S]):
    """How and when frames are drawn."""

    renderer: RendererName = "raycast"
    """Raycast: fast. Pathtrace: photorealistic and slow, needs the extra [photo]; its frames depend a little on whether
    the machine has LLVM or a GPU."""
    device: Literal["cpu"] = "cpu"
    """Where raycast shades its pixels; cpu is the only value, the key is kept for records that name it."""
    spp: Annotated[int, Strict(), Within(1, 65536)] = 64
    """Light paths a pixel of pathtrace: more of them, less noise."""
    denoise: Annotated[bool | None, Strict(), LATER] = None
    """Pathtrace: take the noise out of the traced frames (Open Image Denoise); 8 paths a pixel are enough then.
    Off unless asked for."""
    key_motion_px: Annotated[float, Strict(), Within(0.0, 64.0)] = 4.0
    """Pathtrace: farthest that any point may move in the image between two frames that are traced. The frames between
    are made from both by the known motion. 0: all are traced."""

    max_motion_px: Annotated[float, Strict(), Within(0.01, 16.0)] = 0.5
    """Farthest that any point may move in the image between two frames."""
    min_rate_hz: Annotated[float, Strict(), Within(1.0, 10000.0)] = 60.0
    """Lowest frame rate, when nothing moves."""
