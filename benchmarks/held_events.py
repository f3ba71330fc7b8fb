"""Events on the object and on the hand while nothing slips, pixels without noise.

python benchmarks/held_events.py [--count 4] [--width 173]

Random scenes of the preset complex, whose object is then moved exactly with the hand. Inside object and gripper (two
pixels from their outlines, so that no background shines in) events can only come from light that changes. The light is
taken away step by step; on the last line none should be left.

as drawn         lamp, shadows of hand, object and arm, light from all around
mostly lamp      a hundredth of the background and of the light from it
background alone no lamp, so no shadow; the light from all around changes only where the hand turns
even             no lamp, and the same light from everywhere: nothing is left that could change
"""

import argparse
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from scipy.ndimage import binary_erosion
from scipy.spatial.transform import Rotation

from evslip.config.loading import load_config
from evslip.config.params import Params
from evslip.draws.draw import draw
from evslip.events import EventCamera
from evslip.events.frame import GRIPPER, OBJECT
from evslip.physics.simulation import simulate
from evslip.physics.trajectory import Trajectory
from evslip.rendering import recorded_span, render
from evslip.utils.errors import GraspFailed, PlanRejected

NOISELESS: dict[str, Any] = {"sigma": 0.0, "leak_rate_hz": 0.0, "shot_rate_hz": 0.0}
MARGIN_PX = 2


def held(traj: Trajectory, start_us: int) -> Trajectory:
    """The same motion with the object fixed in the hand as it is at one instant."""
    at = int(np.searchsorted(traj.t_us, start_us))
    hand, body = (
        Rotation.from_quat(poses[:, 3:], scalar_first=True) for poses in (traj.gripper_pose, traj.object_pose)
    )
    place = hand[at].inv().apply(traj.object_pose[at, :3] - traj.gripper_pose[at, :3])
    turn = hand[at].inv() * body[at]
    moved = np.hstack([traj.gripper_pose[:, :3] + hand.apply(place), (hand * turn).as_quat(scalar_first=True)])
    joints = traj.joints.copy()
    joints[:, 7:] = joints[at, 7:]
    return traj._replace(object_pose=moved.astype(np.float32), joints=joints)


def lit(params: Params, even: str) -> dict[str, Params]:
    """The scene in four lights."""
    light = params.light.model_copy(update={"luminance_cd_m2": 0.0})
    dim = params.background.model_copy(update={"luminance_cd_m2": 0.01 * params.background.luminance_cd_m2})
    grey = params.background.model_copy(update={"texture": even})
    table = params.surface.model_copy(update={"texture": even})
    return {
        "as drawn": params,
        "mostly lamp": params.model_copy(update={"background": dim}),
        "background alone": params.model_copy(update={"light": light}),
        "even": params.model_copy(update={"light": light, "background": grey, "surface": table}),
    }


def count(traj: Trajectory, size: tuple[int, int]) -> tuple[np.ndarray, float]:
    """Events on the inside of object and of gripper, and on all pixels; and the seconds that they took to happen."""
    start, end = recorded_span(traj)
    frames = list(render(traj, start_us=start, end_us=end, size=size))
    events = EventCamera("davis346", size=size, seed=0, **NOISELESS).run(frames)
    inside = [np.ones(frames[0].bodies.shape, bool) for _ in range(2)]
    for frame in frames:
        for mask, body in zip(inside, (OBJECT, GRIPPER), strict=True):
            mask &= binary_erosion(frame.bodies == body, iterations=MARGIN_PX)
    places = events.y.astype(int), events.x.astype(int)
    return np.array([*(int(mask[places].sum()) for mask in inside), events.count]), (end - start) / 1e6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=4)
    parser.add_argument("--width", type=int, default=173)
    options = parser.parse_args()
    size = options.width, round(options.width * 260 / 346)
    config, totals, seconds, index, made = load_config("complex"), {}, 0.0, 0, 0
    with tempfile.TemporaryDirectory() as folder:
        even = str(Path(folder) / "even.png")
        Image.new("RGB", (64, 64), (128, 128, 128)).save(even)
        while made < options.count:
            params = draw(config, index)
            index += 1
            try:
                traj = simulate(params)
                start, _ = recorded_span(traj)
            except (GraspFailed, PlanRejected):
                continue
            made += 1
            length = 0.0
            for name, scene in lit(params, even).items():
                found, length = count(held(traj, start)._replace(params=scene), size)
                totals[name] = totals.get(name, 0) + found
            seconds += length
    print(f"{made} samples, {seconds:.1f} s recorded, {size[0]} x {size[1]} pixels; events")
    print(f"{'light':<18}{'on the object':>15}{'on the gripper':>16}{'in all':>14}")
    for name, (on_object, on_gripper, everywhere) in totals.items():
        print(f"{name:<18}{on_object:>15,}{on_gripper:>16,}{everywhere:>14,}")


if __name__ == "__main__":
    main()
