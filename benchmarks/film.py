"""What it saves, and what it costs in accuracy, to draw less often what moves less.

python benchmarks/film.py [PRESET] [COUNT]

Both ways take turns, 50 frames at a time.
"""

import itertools
import sys
import time

import numpy as np

from evslip.camera import hand_camera
from evslip.config import load_config
from evslip.draws import draw
from evslip.rendering import exposure_scale, frame_times, make_artist, recorded_span
from evslip.rendering.pace import cell_motion, plan_cells
from evslip.rendering.poses import Poses
from evslip.rendering.setting import make_lamp
from evslip.simulation import simulate

TURN, EVERY, DARK = 50, 10, 1e-3
"""Frames in a row; every so-manieth is compared; added to luminance before its logarithm."""


def main(preset: str = "simple", count: str = "3") -> None:
    print(
        "| sample | frames | cells drawn | CPU-ms a frame: whole | film | error in log | change from frame to frame |"
    )
    print("|---|---|---|---|---|---|---|")
    for index in range(int(count)):
        traj = simulate(draw(load_config(preset), index))
        camera, span, params = hand_camera(traj.params), recorded_span(traj), traj.params
        times = frame_times(traj, *span, camera=camera)
        poses = Poses(traj, camera, times)
        motion = camera.stretch() * cell_motion(poses, camera.pinhole(), params, make_lamp(params))
        plan = plan_cells(motion, np.zeros(len(motion), bool), params.render.max_motion_px)
        filming, drawing = (make_artist(None, traj, camera, span) for _ in range(2))
        scale = exposure_scale(drawing, traj, camera, span[0])
        reel = filming.film(poses, scale)
        spent, errors, changes = np.zeros(2), [], []
        for start in range(0, len(times), TURN):
            begun = time.process_time()
            film = [image for image, _ in itertools.islice(reel, TURN)]
            middle = time.process_time()
            whole = [drawing.draw(poses, k, scale)[0] for k in range(start, min(start + TURN, len(times)))]
            spent += (time.process_time() - middle, middle - begun)
            for k in range(0, len(whole), EVERY):
                light = np.log(whole[k] + DARK)
                errors.append(np.abs(np.log(film[k] + DARK) - light).mean())
                if k > 0:
                    changes.append(np.abs(light - np.log(whole[k - 1] + DARK)).mean())
        each = spent / len(times) * 1e3
        print(
            f"| {index} | {len(times)} | {np.mean(plan.slots >= 0):.2f} | {each[0]:.2f} | {each[1]:.2f} "
            f"| {np.mean(errors):.4f} | {np.mean(changes):.4f} |"
        )


if __name__ == "__main__":
    main(*sys.argv[1:])
