"""What is varied: worlds that no detector was trained on, nuisances of growing strength, and the randomisation that an
ablation takes away again.

All are the preset `complex` with some keys replaced, as `evslip generate complex ... --set KEY=VALUE` takes them. Draws
are keyed by the index: a sample of a world has the other parameters of the sample of that number in the test set.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import trimesh

MESH = "MESH"
"""Stands for the path of the mesh that `write_mesh` makes."""


class World(NamedTuple):
    """A test set that differs from the training set in kind."""

    title: str
    keys: dict[str, str]


WORLDS = {
    "front": World("camera in front of the hand", {"camera.mount": "front"}),
    "cylinder": World("cylinders", {"object.shape": "cylinder"}),
    "mesh": World("jars (a mesh)", {"object.shape": "mesh", "object.mesh": MESH}),
    "dvxplorer": World("pixels of a DVXplorer", {"sensor.preset": "dvxplorer"}),
    "prophesee": World("pixels like Prophesee's", {"sensor.preset": "prophesee-like"}),
    "noise": World("more noise", {"sensor.leak_rate_hz": "0.1", "sensor.shot_rate_hz": "5.0"}),
    "absolute": World("absolute exposure", {"camera.exposure": "absolute"}),
    "pathtraced": World("path-traced frames", {"render.renderer": "pathtrace", "render.spp": "16"}),
    "shake": World("shaking", {"motion.kind": "shake"}),
    "rotate": World("turning to and fro", {"motion.kind": "rotate"}),
}


@dataclass(frozen=True)
class Nuisance:
    """One way in which the world misbehaves, at several strengths."""

    title: str
    unit: str
    """Of the strengths; "" where they are names."""
    strengths: tuple[float | str, ...]
    """Growing, or names in place of numbers; what the world is like without it comes before the first."""
    middle: float | str
    """The strength that a detector should bear."""
    varied: dict[str, float]
    """Keys that hold the strength, and how many of their units it is of each."""
    fixed: dict[str, str] = field(default_factory=dict)
    """Keys that are the same at every strength."""

    def keys(self, strength: float | str) -> dict[str, str]:
        """The keys that are replaced at one strength."""
        own = {k: strength if isinstance(strength, str) else f"{strength * one:g}" for k, one in self.varied.items()}
        return self.fixed | own


NUISANCES = {
    "flicker": Nuisance(
        "flicker of lamp and surroundings, 100 Hz", "depth", (0.1, 0.3, 0.6, 1.0), 0.3,
        {"flicker.lamp_depth": 1.0, "flicker.surroundings_depth": 1.0},
    ),
    "pwm": Nuisance(
        "pulses of the lamp, 200 Hz", "depth", (0.1, 0.3, 0.6, 1.0), 0.3,
        {"flicker.lamp_depth": 1.0}, {"flicker.waveform": "pwm", "flicker.frequency_hz": "200.0"},
    ),
    "mount": Nuisance(
        "camera trembling on its mount, 40 Hz", "mm rms", (0.05, 0.1, 0.2, 0.4), 0.2,
        {"vibration.mount_m": 1e-3, "vibration.mount_deg": 0.1}, {"vibration.mount_hz": "40.0"},
    ),
    "object": Nuisance(
        "object trembling in its pads, 30 Hz", "mm rms", (0.1, 0.2, 0.4, 0.8), 0.4,
        {"vibration.object_m": 1e-3, "vibration.object_deg": 0.75}, {"vibration.object_hz": "30.0"},
    ),
    "tremor": Nuisance(
        "tremor of the arm's joints, 8 Hz", "deg rms", (0.01, 0.02, 0.04, 0.08), 0.02,
        {"vibration.tremor_deg": 1.0}, {"vibration.tremor_hz": "8.0"},
    ),
    "dust": Nuisance(
        "dust on the lens", "spots", (5, 12, 25, 50), 12,
        {"lens.spots": 1.0}, {"lens.spot_opacity": "0.5"},
    ),
    "glare": Nuisance("veiling glare", "share of the light", (0.05, 0.1, 0.2, 0.4), 0.1, {"lens.glare": 1.0}),
    "shot": Nuisance("shot noise", "Hz a pixel", (1, 2, 5, 10), 5, {"sensor.shot_rate_hz": 1.0}),
    "lost": Nuisance("events lost at random", "share", (0.1, 0.2, 0.4, 0.8), 0.2, {"readout.lost_share": 1.0}),
    "bursts": Nuisance("bursts of whole rows", "bursts/s", (5, 20, 50, 100), 20, {"readout.row_bursts_hz": 1.0}),
    "clock": Nuisance("clock jumping by 1 ms", "jumps/s", (1, 2, 5, 20), 2, {"readout.jumps_hz": 1.0}),
    "finish": Nuisance(
        "finish (cylinders, a low lamp)", "", ("matt", "plastic", "film", "metal"), "film",
        {"object.finish": 1.0}, {"object.shape": "cylinder", "light.polar_deg": "{min=65.0,max=88.0}"},
    ),
    "passers": Nuisance("bodies crossing the background", "bodies", (1, 2, 3, 5), 2, {"passers.count": 1.0}),
    "shadows": Nuisance(
        "bodies crossing the lamp's light", "bodies", (1, 2, 3, 5), 2,
        {"passers.count": 1.0}, {"passers.crosses": "light"},
    ),
    "turn": Nuisance("surroundings turning", "deg/s", (2, 5, 10, 20), 10, {"background.turn_deg_s": 1.0}),
    "mounts": Nuisance(
        "mount of the camera", "", ("side", "front", "finger", "finger-right"), "finger", {"camera.mount": 1.0}
    ),
    "clutter": Nuisance("clutter on the table", "objects", (1, 2, 3, 5), 3, {"clutter.count": 1.0}),
}  # fmt: skip


EVERYTHING = {
    "camera.x_m": "{min=-0.005,max=0.005}",
    "camera.y_m": "{min=-0.005,max=0.005}",
    "camera.z_m": "{min=-0.005,max=0.005}",
    "camera.yaw_deg": "{min=-3.0,max=3.0}",
    "camera.pitch_deg": "{min=-3.0,max=3.0}",
    "camera.roll_deg": "{min=-5.0,max=5.0}",
    "sensor.leak_rate_hz": "{min=0.0,max=0.2}",
    "sensor.shot_rate_hz": "{min=0.0,max=2.0}",
    "sensor.theta": "{min=0.1,max=0.3}",
}
"""Lights and textures are random in `complex`; here so are the camera's place, the noise and the contrast threshold."""

FIXED = {
    "lights": World(
        "lights",
        {
            "background.luminance_cd_m2": "3000.0",
            "light.luminance_cd_m2": "4.5e6",
            "light.distance_m": "30.0",
            "light.azimuth_deg": "60.0",
            "light.polar_deg": "40.0",
        },
    ),
    "textures": World(
        "textures",
        {"object.texture": "cardboard-0", "surface.texture": "wood-0", "background.texture": "brick-1"},
    ),
    "camera": World("the camera's place", {key: "0.0" for key in EVERYTHING if key.startswith("camera.")}),
    "noise": World("noise", {"sensor.leak_rate_hz": "0.01", "sensor.shot_rate_hz": "0.001"}),
    "threshold": World("the contrast threshold", {"sensor.theta": "0.15"}),
}
"""What each step of the ablation fixes: the values of `simple` and of the DAVIS346, textures of the training split."""


def write_mesh(path: Path) -> None:
    """A jar of unit size: a wide body and a narrower neck, by which it is gripped."""
    profile = [[0, 0], [0.5, 0], [0.5, 0.35], [0.4, 0.5], [0.4, 1], [0, 1]]
    path.parent.mkdir(parents=True, exist_ok=True)
    trimesh.creation.revolve(profile, sections=96).export(path)
