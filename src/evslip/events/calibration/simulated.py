"""Events that pixels make of what the sensor of a recording has seen."""

from typing import Any

from evslip.events.calibration.scene import Scene
from evslip.events.camera import MOST_NOISE, EventCamera
from evslip.events.stream import Events

SETTLING_US = 2e7
"""Time for which simulated pixels see the first frame before the recording begins; less where their noise alone ..."""
MOST_SETTLING = 0.999 * MOST_NOISE
"""... would make more events: then every pixel has had many, and is steady sooner."""


def simulated(scene: Scene, parameters: dict[str, Any], seed: int) -> Events:
    """Events of pixels with these parameters of `PixelModel`, see `settled`."""
    camera = EventCamera("clean", size=scene.size, seed=seed, **parameters)
    # Leak and noise have had time to become steady before the recording.
    noise_hz = camera.model.noise_hz(scene.size[0] * scene.size[1])
    camera.step(scene.times_us[0] - min(SETTLING_US, 1e6 * MOST_SETTLING / max(noise_hz, 1.0)), scene.light[0])
    return settled(camera.run(zip(scene.times_us.tolist(), scene.light, strict=True)), scene)


def settled(events: Events, scene: Scene) -> Events:
    """Events after the second exposure: what the pixels saw before the first one is not known."""
    return events.between(int(scene.exposures_us[1]), int(scene.exposures_us[-1]))
