"""An event camera in a MuJoCo simulation of your own: any model, any of its cameras.

python examples/mujoco_any_scene.py events.h5 [--model scene.xml] [--camera NAME] [--seconds 1] [--fps 500]
"""

import argparse
import os
import sys
from pathlib import Path

from evslip.codecs import write_events
from evslip.events import EventCamera, concatenate

if sys.platform == "linux" and not os.environ.get("DISPLAY"):
    os.environ.setdefault("MUJOCO_GL", "egl")  # without a screen; must be set before mujoco is imported

NO_GL = (
    "MuJoCo cannot open an OpenGL context ({}). Without a screen, install EGL (Debian: apt install libegl1) or set "
    "MUJOCO_GL=osmesa (apt install libosmesa6)"
)
try:
    import mujoco
except Exception as error:  # what the OpenGL libraries raise when they find no driver is of many kinds
    sys.exit(NO_GL.format(" ".join(str(error).split())[:100]))

GREY = (0.2126, 0.7152, 0.0722)
SCENE = """
<mujoco>
  <asset>
    <texture name="checks" type="2d" builtin="checker" rgb1=".2 .3 .4" rgb2=".7 .7 .6" width="300" height="300"/>
    <material name="floor" texture="checks" texrepeat="6 6"/>
    <material name="box" texture="checks" texrepeat="2 2"/>
  </asset>
  <worldbody>
    <light pos="0 0 4"/>
    <geom type="plane" size="2 2 .1" material="floor"/>
    <body pos="0 0 .8"><freejoint/><geom type="box" size=".2 .15 .1" euler="30 20 0" material="box"/></body>
    <camera name="front" pos="0 -1.6 .8" xyaxes="1 0 0 0 .4 .9"/>
  </worldbody>
</mujoco>
"""


def main(out: Path, path: Path | None, view: str | int, seconds: float, fps: float) -> None:
    model = mujoco.MjModel.from_xml_path(str(path)) if path else mujoco.MjModel.from_xml_string(SCENE)
    data = mujoco.MjData(model)
    camera = EventCamera("davis346", size=(346, 260), intensity="uint8")
    parts, frames = [], 0
    with open_renderer(model) as renderer:
        while data.time < seconds:
            mujoco.mj_step(model, data)
            if data.time * fps >= frames:
                renderer.update_scene(data, view)
                # Frames close in time: edges should move by less than a pixel or two from one to the next.
                parts.append(camera.step(1e6 * data.time, renderer.render() @ GREY))
                frames += 1
    events = concatenate(parts)
    write_events(out, events, (346, 260))
    print(f"{out}: {events.count:,} events from {frames} frames, {events.p.mean():.0%} ON")


def open_renderer(model: mujoco.MjModel) -> mujoco.Renderer:
    """MuJoCo's renderer, or one line that says what it needs."""
    model.vis.global_.offwidth, model.vis.global_.offheight = 640, 480
    try:
        return mujoco.Renderer(model, 260, 346)
    except Exception as error:
        sys.exit(NO_GL.format(" ".join(str(error).split())[:100]))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--model", type=Path)
    parser.add_argument("--camera", default=None)
    parser.add_argument("--seconds", type=float, default=1.0)
    parser.add_argument("--fps", type=float, default=500.0)
    options = parser.parse_args()
    # -1 is MuJoCo's free camera, which every model has.
    view = options.camera or (-1 if options.model else "front")
    main(options.out, options.model, view, options.seconds, options.fps)
