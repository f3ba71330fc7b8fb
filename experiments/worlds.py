"""What is varied: worlds that no detector was trained on, and the randomisation that an ablation takes away again.

All are the preset `complex` with some keys replaced, as `evslip generate complex ... --set KEY=VALUE` takes them. Draws
are keyed by the index: a sample of a world has the other parameters of the sample of that number in the test set.
"""

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
