"""What it saves, and what it costs in accuracy, to draw less often what moves less.

python benchmarks/draw_sequence.py [PRESET] [COUNT] [KEY=VALUE ...]

Both ways take turns, 50 frames at a time. The error is the mean one in the logarithm of luminance: of all pixels, and
of those that show object, gripper or arm.
"""

import itertools
import sys
import time

import numpy as np

from evslip.config.loading import load_config, parse_override
from evslip.draws.draw import draw
from evslip.events.frame import OBJECT
from evslip.physics.simulation import simulate
from evslip.rendering import exposure_scale, frame_times, make_renderer, recorded_span
from evslip.rendering.camera import hand_camera
from evslip.rendering.materials.paint import shines
from evslip.rendering.poses import ScenePoses
from evslip.rendering.raycast.setting import make_lamp
from evslip.rendering.timing.cell_motion import cell_motion, cell_sway
from evslip.rendering.timing.foreground import foreground_motion
from evslip.rendering.timing.update_schedule import plan_cells
from evslip.utils.errors import ConfigError

TURN, EVERY, DARK = 50, 7, 1e-3
"""Frames in a row; every so-manieth is compared, no multiple of `cell_motion.LAG`; added before the logarithm."""


def main(preset: str = "simple", count: str = "3", *changes: str) -> None:
    try:
        config = load_config(preset, dict(map(parse_override, changes)))
    except ConfigError as error:
        sys.exit(str(error))
    print(
        "| sample | frames | drawn: cells | bodies | CPU-ms a frame: whole | in sequence "
        "| error | change from frame to frame | of bodies: error | change |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|")
    for index in range(int(count)):
        traj = simulate(draw(config, index))
        camera, span, params = hand_camera(traj.params), recorded_span(traj), traj.params
        times = frame_times(traj, *span, camera=camera)
        poses = ScenePoses(traj, camera, times)
        scene = (poses, camera.pinhole(), params, make_lamp(params))
        sway = cell_sway(poses, camera.pinhole(), params, camera.stretch())
        behind, _ = cell_motion(*scene, shines(params.surface.texture))
        still = np.zeros(len(times) - 1, bool)
        drawn = [
            np.mean(plan_cells(camera.stretch() * motion, still, params.render.max_motion_px, sway=way).slots >= 0)
            for motion, way in ((behind, sway), (foreground_motion(*scene), None))
        ]
        together, alone = (make_renderer(None, traj, camera, span) for _ in range(2))
        scale = exposure_scale(alone, traj, camera, span[0])
        sequence = together.draw_sequence(poses, scale)
        spent, errors, steps = np.zeros(2), [], []
        for start in range(0, len(times), TURN):
            begun = time.process_time()
            frames = [image for image, _ in itertools.islice(sequence, TURN)]
            middle = time.process_time()
            whole = [alone.draw(poses, k, scale) for k in range(start, min(start + TURN, len(times)))]
            spent += (time.process_time() - middle, middle - begun)
            for k in range(1, len(whole), EVERY):
                light, bodies = np.log(whole[k][0] + DARK), whole[k][1] >= OBJECT
                for found, other in ((errors, frames[k]), (steps, whole[k - 1][0])):
                    away = np.abs(np.log(other + DARK) - light)
                    found.append((away.mean(), away[bodies].mean() if bodies.any() else 0.0))
        each = spent / len(times) * 1e3
        print(
            f"| {index} | {len(times)} | {drawn[0]:.2f} | {drawn[1]:.2f} | {each[0]:.2f} | {each[1]:.2f} "
            + "".join(
                f"| {error:.5f} | {step:.4f} "
                for error, step in zip(np.mean(errors, 0), np.mean(steps, 0), strict=True)
            )
            + "|"
        )


if __name__ == "__main__":
    main(*sys.argv[1:])
