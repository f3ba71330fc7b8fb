"""The flicker of the light."""

from typing import Annotated, Generic

from evslip.config.section import N, OneOf, S, Section, Within, usual

WAVEFORMS = ("sine", "pwm")


class FlickerSpec(Section, Generic[N, S]):
    """How light changes about its mean, which stays the same, with a phase of each sample's own."""

    lamp_depth: Annotated[N, Within(0.0, 1.0)] = usual(0.0)
    """Depth of the lamp's flicker, (max - min) / (max + min); 0: the lamp is still. Filament lamps 0.1 to 0.2,
    fluorescent ones 0.3, LEDs up to 1 (IEEE 1789)."""
    surroundings_depth: Annotated[N, Within(0.0, 1.0)] = usual(0.0)
    """Depth of the flicker of the light from all around; 0 as of daylight. Where it differs from lamp_depth, a frame
    takes two renderings."""
    waveform: Annotated[S, OneOf(WAVEFORMS)] = usual("sine")
    """Sine: as from the mains. Pwm: on and off, as of a dimmed LED."""
    frequency_hz: Annotated[N, Within(10.0, 1000.0)] = usual(100.0)
    """Periods a second: twice the frequency of the mains, 100 or 120, or that of the dimmer."""
    harmonic: Annotated[N, Within(0.0, 0.25)] = usual(0.2)
    """Sine: amplitude of the second harmonic over that of the first; 0.2 as of a rectified sine, less where a filament
    or phosphor glows on."""
    duty: Annotated[N, Within(0.05, 0.95)] = usual(0.5)
    """Pwm: share of the period that the light is bright."""
