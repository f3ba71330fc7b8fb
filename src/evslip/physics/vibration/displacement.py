"""Displacement by vibration, of the camera on its mount and of the object in the hand.

The pads give way and stick, so that an object that trembles does not slip. The physics holds it in pads that are rigid
in their plane, so this is added to its poses afterwards.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from evslip.config.params import Params
from evslip.config.views import camera_names, seen_by
from evslip.physics.grip import camera_place_m
from evslip.physics.held import held_span, recorded
from evslip.physics.motion.above_table import require_camera_above
from evslip.physics.robots.description import TCP_M
from evslip.physics.trajectory import Trajectory, rotation_of
from evslip.physics.vibration.noise import shaped_noise
from evslip.physics.vibration.resonance import Resonance
from evslip.scene.motions.steps import step
from evslip.utils.errors import GraspFailed
from evslip.utils.seeds import generator

RAMP_S = 0.05
"""Time in which an object that is lifted begins to tremble, and in which it stops before it stands or is lost."""
CAMERA, OBJECT = "mount", "object"
"""Parts that tremble."""
IN_PADS = [0, 2, 4]
"""Directions in which the pads give way: along the hand's x and z, and about its y, the closing axis."""


def with_vibration(trajectory: Trajectory) -> Trajectory:
    """The trajectory with what its parameters let tremble. Raises PlanRejected for a camera that trembles into the
    table, and GraspFailed for one of a grip that never closes."""
    spec = trajectory.params.vibration
    if spec.mount_hz is not None and not camera_names(trajectory.params):
        trajectory = _with_camera_moved(trajectory)
    if spec.object_hz is None:
        return trajectory
    return with_object_moved(trajectory, object_displacement(trajectory))


def seen_from(trajectory: Trajectory, camera: str) -> Trajectory:
    """The trajectory with the parameters of one of several cameras, and the displacement of that one on its mount.
    Raises ConfigError, and PlanRejected and GraspFailed as `with_vibration`."""
    seen = trajectory._replace(params=seen_by(trajectory.params, camera))
    return seen if seen.params.vibration.mount_hz is None else _with_camera_moved(seen)


def _with_camera_moved(trajectory: Trajectory) -> Trajectory:
    moved = camera_displacement(trajectory)
    first, last = recorded(trajectory)
    hand, place = trajectory.gripper_pose[first:last], camera_place_m(trajectory.params) + moved[first:last, :3]
    height = hand[:, 2] + rotation_of(hand).apply(place)[:, 2]
    remedy = "give its mount a higher frequency (vibration.mount_hz), or move it up (a smaller camera.z_m)"
    require_camera_above(trajectory.params, trajectory.t_us[first:last] / 1e6, height, remedy)
    return trajectory._replace(camera_displacement=moved)


def with_object_moved(trajectory: Trajectory, moved: np.ndarray) -> Trajectory:
    hand, body = rotation_of(trajectory.gripper_pose), rotation_of(trajectory.object_pose)
    turn = hand * rotation_of(moved) * hand.inv()
    tool = trajectory.gripper_pose[:, :3] + hand.apply(TCP_M)
    place = tool + turn.apply(trajectory.object_pose[:, :3] - tool) + hand.apply(moved[:, :3])
    is_moved = np.any(moved != as_poses(np.zeros((1, 6))), axis=1, keepdims=True)
    pose = np.where(is_moved, _poses(place, turn * body), trajectory.object_pose)
    return trajectory._replace(object_pose=pose, object_displacement=moved)


def without_vibration(trajectory: Trajectory) -> Trajectory:
    """The trajectory with the object where it would be in pads that do not give way, within 0.1 micrometres."""
    moved = trajectory.object_displacement
    if moved is None:
        return trajectory
    hand, body = rotation_of(trajectory.gripper_pose), rotation_of(trajectory.object_pose)
    back = hand * rotation_of(moved).inv() * hand.inv()
    tool = trajectory.gripper_pose[:, :3] + hand.apply(TCP_M)
    place = tool + back.apply(trajectory.object_pose[:, :3] - hand.apply(moved[:, :3]) - tool)
    pose = np.hstack([place, (back * body).as_quat(scalar_first=True)])
    return trajectory._replace(object_pose=pose, object_displacement=None)


def camera_displacement(trajectory: Trajectory) -> np.ndarray:
    """Displacement of the camera on its mount, as in `Trajectory`: a damped resonance along and about each axis that
    noise and the hand's acceleration drive all the time."""
    steps, step_s = _sampling(trajectory)
    acceleration = hand_acceleration(trajectory, camera_place_m(trajectory.params))
    return as_poses(Tremble(trajectory.params, CAMERA, steps, step_s).advance(acceleration))


def object_displacement(trajectory: Trajectory) -> np.ndarray:
    """Displacement of the object in the pads, as in `Trajectory`: a damped resonance that noise and the hand's
    acceleration drive while the object hangs in the grip."""
    steps, step_s = _sampling(trajectory)
    moved = np.zeros((steps, 6))
    try:
        first, last, _ = held_span(trajectory, *recorded(trajectory))
    except GraspFailed:
        return as_poses(moved)
    acceleration = hand_acceleration(trajectory, TCP_M)[first:last, IN_PADS]
    tremble = Tremble(trajectory.params, OBJECT, last - first, step_s).advance(acceleration)
    t_s = (trajectory.t_us[first:last] - trajectory.t_us[first]) / 1e6
    ramp = step(t_s, 0.0, RAMP_S) * step(t_s[-1] - t_s, 0.0, RAMP_S)
    moved[first:last, IN_PADS] = ramp[:, None] * tremble
    return as_poses(moved)


class Tremble:
    """A damped resonance that noise and the acceleration of its base drive, over a number of steps."""

    def __init__(self, params: Params, part: str, steps: int, step_s: float):
        """part: CAMERA or OBJECT."""
        spec = params.vibration
        if part == CAMERA:
            hz, damping = spec.mount_hz, spec.mount_damping
            rms = [spec.mount_m] * 3 + [float(np.radians(spec.mount_deg))] * 3
        else:
            hz, damping = spec.object_hz, spec.object_damping
            rms = [spec.object_m] * 2 + [float(np.radians(spec.object_deg))]
        assert hz is not None
        self._resonance, self._rms, self._step_s, self._done = Resonance(hz, damping), np.array(rms), step_s, 0
        name = f"vibration {part}"
        rng = generator(params.seed, params.split, params.index, params.stage(name) if part == CAMERA else name)
        self._noise = shaped_noise(rng, steps, len(rms), step_s, self._resonance.gain)
        self._state = np.zeros((2, len(rms)))

    def advance(self, acceleration: np.ndarray) -> np.ndarray:
        """Displacement in the next steps for the acceleration (n, k) of the base in them; (n, k)."""
        noise = self._noise[self._done : self._done + len(acceleration)]
        self._done += len(acceleration)
        response, self._state = self._resonance.response(acceleration, self._step_s, self._state)
        return self._rms * noise + response


def _sampling(trajectory: Trajectory) -> tuple[int, float]:
    """Number of samples, and seconds between them."""
    return len(trajectory.t_us), float(trajectory.t_us[1] - trajectory.t_us[0]) / 1e6


def hand_acceleration(trajectory: Trajectory, point_m: np.ndarray) -> np.ndarray:
    """Acceleration of a point (3,) that is fixed in the hand, and angular acceleration, along the hand's axes; of shape
    (n, 6), in m/s2 and rad/s2."""
    t_s = trajectory.t_us / 1e6
    hand = rotation_of(trajectory.gripper_pose)
    place = trajectory.gripper_pose[:, :3] + hand.apply(point_m)
    turned = (hand[:-1].inv() * hand[1:]).as_rotvec() / np.diff(t_s)[:, None]
    middle_s = (t_s[1:] + t_s[:-1]) / 2
    angular = np.diff(turned, axis=0) / np.diff(middle_s)[:, None]
    velocity = np.diff(place, axis=0) / np.diff(t_s)[:, None]
    linear = hand[1:-1].inv().apply(np.diff(velocity, axis=0) / np.diff(middle_s)[:, None])
    return np.pad(np.hstack([linear, angular]), ((1, 1), (0, 0)), mode="edge")


def as_poses(moved: np.ndarray) -> np.ndarray:
    """Shifts and rotation vectors (n, 6) as poses (n, 7)."""
    return _poses(moved[:, :3], Rotation.from_rotvec(moved[:, 3:]))


def _poses(place: np.ndarray, turn: Rotation) -> np.ndarray:
    return np.hstack([place, turn.as_quat(scalar_first=True)]).astype(np.float32)
