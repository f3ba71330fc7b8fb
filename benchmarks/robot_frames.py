"""What a frame costs with each robot in view.

python benchmarks/robot_frames.py [ROBOT ...] [--size WIDTH HEIGHT]

All frames of one sample each, with the same object and motion. The robots take turns, each a fiftieth of its frames, so
that a busy machine slows all of them alike.
"""

import argparse
import itertools
import math
import time
from collections.abc import Iterator

from physics_cases import ROBOTS, robot_keys

from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.physics.simulation import simulate
from evslip.rendering import exposure_scale, frame_times, make_renderer, recorded_span
from evslip.rendering.camera import hand_camera
from evslip.rendering.poses import ScenePoses
from evslip.utils.errors import ConfigError

TURNS = 50
SAMPLE = {"motion.duration_s": 8.0, "object.x_m": 0.45, "object.y_m": 0.0, "motion.move_y_m": -0.15}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robots", nargs="*", default=[*ROBOTS, "examples/own_robot/robot.toml"])
    parser.add_argument("--size", type=int, nargs=2, default=(173, 130))
    options = parser.parse_args()
    robots = ["panda", *(robot for robot in options.robots if robot != "panda")]
    try:
        sequences = {robot: _frames(robot, *options.size) for robot in robots}
    except ConfigError as error:
        parser.error(str(error))
    for _, sequence in sequences.values():  # what is compiled or kept at first does not count
        next(sequence)
    spent = dict.fromkeys(robots, 0.0)
    for _ in range(TURNS):
        for robot, (count, sequence) in sequences.items():
            start = time.process_time()
            for _ in itertools.islice(sequence, math.ceil(count / TURNS)):
                pass
            spent[robot] += time.process_time() - start
    print("| robot | frames | CPU-ms a frame | over the Panda's |\n|---|---|---|---|")
    for robot, (count, _) in sequences.items():
        each = spent[robot] / count
        print(f"| `{robot}` | {count} | {1e3 * each:.2f} | {each / (spent['panda'] / sequences['panda'][0]):.2f} |")


def _frames(robot: str, width: int, height: int) -> tuple[int, Iterator[object]]:
    """Number of frames, and the frames."""
    config = load_config("simple", SAMPLE | robot_keys(robot) | {"camera.width": width, "camera.height": height})
    trajectory = simulate(draw(config, 0))
    camera, span = hand_camera(trajectory.params), recorded_span(trajectory)
    times = frame_times(trajectory, *span, camera=camera)
    poses = ScenePoses(trajectory, camera, times)
    renderer = make_renderer(None, trajectory, camera, span)
    scale = exposure_scale(renderer, trajectory, camera, span[0])
    return len(times), iter(renderer.draw_sequence(poses, scale))


if __name__ == "__main__":
    main()
