"""How much the light on what is held changes from one traced frame to the next: true changes, and noise of tracing.

python benchmarks/flicker.py [PRESET] [INDEX] [TIME_S] [PATHS ...]

The fast renderer has no noise, so what it shows to change is true. Noise of the same random numbers stands still only
where all that light meets on its way does; it halves with four times the paths. Denoised
frames have less. Needs the extra [photo].
"""

import sys

import numpy as np

from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.events.frame import BODIES, GRIPPER, OBJECT
from evslip.physics.simulation import simulate
from evslip.rendering import exposure_scale, frame_times, make_renderer, recorded_span
from evslip.rendering.camera import hand_camera
from evslip.rendering.pathtrace.keyframes import plan_keyframes
from evslip.rendering.poses import ScenePoses
from evslip.rendering.timing.schedule import image_motion
from evslip.utils.errors import EvslipError

FRAMES, AROUND = 4, 3
"""Traced ones, `render.key_motion_px` of the image apart, and how many more before and after them."""


def main(preset: str = "complex", index: str = "3", time_s: str = "2.57", *paths: str) -> None:
    counts = [int(count) for count in paths] or [16, 64, 256]
    fast = simulate(draw(load_config(preset), int(index), "test"))
    camera, span = hand_camera(fast.params), recorded_span(fast)
    times = frame_times(fast, *span, camera=camera)
    motion = image_motion(ScenePoses(fast, camera, times), camera.pinhole(), fast.params)
    traced = times[plan_keyframes(motion, fast.params.render.key_motion_px).keys]
    first = np.searchsorted(traced, float(time_s) * 1e6)
    if not AROUND <= first <= len(traced) - FRAMES - AROUND:
        raise ValueError(
            f"TIME_S: {time_s} is too early or too late, expected about {traced[len(traced) // 2] / 1e6:g}"
        )
    print("| paths a pixel | body | mean change of ln luminance | share of pixels over 0.15 |")
    print("|---|---|---|---|")
    for spp, denoise in ((None, False), *((count, False) for count in counts), *((count, True) for count in counts)):
        keys = {"render.renderer": "pathtrace", "render.spp": spp, "render.denoise": denoise} if spp else {}
        traj = fast._replace(params=draw(load_config(preset, keys), int(index), "test"))
        raycaster = make_renderer(None, traj, camera, span)
        poses = ScenePoses(traj, camera, traced[first - AROUND : first + FRAMES + AROUND])
        scale = exposure_scale(raycaster, traj, camera, span[0])
        pictures, bodies = zip(*(raycaster.draw(poses, k, scale) for k in range(AROUND, AROUND + FRAMES)), strict=True)
        changes = np.abs(np.diff(np.log(np.array(pictures) + 0.01), axis=0))
        for body in (OBJECT, GRIPPER):
            found = changes[:, np.all(np.array(bodies) == body, 0)]
            name = "none: the fast renderer" if spp is None else f"{spp}, denoised" if denoise else spp
            print(f"| {name} | {BODIES[body]} | {found.mean():.4f} | {np.mean(found > 0.15):.3f} |", flush=True)


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except (EvslipError, ValueError) as error:
        sys.exit(f"flicker.py: {error}")
