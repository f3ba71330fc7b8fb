"""Vibration: of the camera on its mount, of the object in the pads, and of the arm."""

from typing import Annotated, Generic

from evslip.config.section import N, S, Section, Within, usual, wrong

HIGHEST_HZ = 200.0
"""Five samples a period of what is kept at 1 kHz."""


class VibrationSpec(Section, Generic[N, S]):
    """Parts that tremble: off unless a frequency is given."""

    mount_hz: Annotated[N | None, Within(1.0, HIGHEST_HZ)] = None
    """Natural frequency of the camera's mount on the hand, along and about each axis. Noise and the hand's acceleration
    push the camera."""
    mount_damping: Annotated[N, Within(0.005, 2.0)] = usual(0.05)
    """Damping ratio of that; 1 is critical."""
    mount_m: Annotated[N, Within(0.0, 0.005)] = usual(0.0)
    """Rms amplitude that noise gives the camera along each axis of the hand."""
    mount_deg: Annotated[N, Within(0.0, 5.0)] = usual(0.0)
    """Rms amplitude that noise gives the camera about each axis, through the camera."""
    object_hz: Annotated[N | None, Within(1.0, HIGHEST_HZ)] = None
    """Natural frequency of the held object in its compliant pads, which stick: it trembles in their plane and about
    their axis, and is pushed by the hand's acceleration. No slip."""
    object_damping: Annotated[N, Within(0.005, 2.0)] = usual(0.05)
    """Damping ratio of that; 1 is critical."""
    object_m: Annotated[N, Within(0.0, 0.005)] = usual(0.0)
    """Rms amplitude that noise gives the object along each axis."""
    object_deg: Annotated[N, Within(0.0, 5.0)] = usual(0.0)
    """Rms amplitude that noise gives the object about the closing axis, through the tool centre."""
    tremor_hz: Annotated[N | None, Within(0.5, 60.0, "the servos follow no faster")] = None
    """Middle of the band in which the joints of the arm tremble."""
    tremor_band_hz: Annotated[N, Within(0.1, 60.0)] = usual(4.0)
    """Width of that band."""
    tremor_deg: Annotated[N, Within(0.0, 0.5)] = usual(0.0)
    """Rms amplitude of each joint's command, which the physics follows: it shakes all that the hand carries."""

    def _check(self) -> None:
        for name, value in self:
            part, _, _ = name.partition("_")
            if value != type(self).model_fields[name].default and getattr(self, f"{part}_hz") is None:
                raise wrong(name, f"needs vibration.{part}_hz, the frequency")
