"""Depth, normal and motion of what each pixel sees, by one exact ray through its middle."""

from collections.abc import Collection

import numpy as np

from evslip.config.params import Params
from evslip.physics.trajectory import Trajectory
from evslip.rendering.camera import Camera
from evslip.rendering.geometry.hand import HAND, LEFT, RIGHT, assemble
from evslip.rendering.geometry.links import MOST_LINKS, hulls, posed
from evslip.rendering.geometry.supersampling import NEAR_M
from evslip.rendering.poses import ScenePoses
from evslip.scene.shapes import surface_of
from evslip.scene.shapes.surface import Surface
from evslip.utils.errors import ConfigError
from evslip.utils.jit import compiled

OUTPUTS = ("depth", "normal", "motion")
"""Names of the arrays of `evslip.events.frame.Frame` that are made on request."""
HALF_STEP_US = 500
"""Motion is measured between poses this long before and after: together one step of the simulation's record."""
OBJECT, SURFACE, SKY, FIRST_LINK = RIGHT + 1, RIGHT + 2, RIGHT + 3, RIGHT + 4
FIRST_DISTRACTOR = FIRST_LINK + MOST_LINKS
"""Parts of the scene, after those of the gripper in `hand`; the last two are the first of the arm's links and the first
of the distractors."""


def check_outputs(names: Collection[str]) -> None:
    """Raise ConfigError for a name that is no output."""
    for name in (names,) if isinstance(names, str) else names:
        if name not in OUTPUTS or isinstance(names, str):
            raise ConfigError(f"outputs: {name!r} is unknown; expected any of {', '.join(OUTPUTS)}, as a tuple")


class Outputs:
    """Depth, normals and motion of a trajectory's instants, independent of one another and of the frame times."""

    def __init__(self, traj: Trajectory, camera: Camera, names: Collection[str]):
        """names: of OUTPUTS."""
        self._traj, self._camera, self._names, self._pixel_rays = traj, camera, names, PixelRays(traj.params, camera)

    def at(self, t_us: int) -> dict[str, np.ndarray]:
        """The arrays of one instant by name, with shapes and units as in `Frame`."""
        first, last = int(self._traj.t_us[0]), int(self._traj.t_us[-1])
        around = (t_us, max(first, t_us - HALF_STEP_US), min(last, t_us + HALF_STEP_US))
        poses = ScenePoses(self._traj, self._camera, np.array(around))
        depth, normal, part = self._pixel_rays.cast(poses, 0)
        made = {}
        if "depth" in self._names:
            made["depth"] = np.where(part == SKY, np.inf, depth).astype(np.float32)
        if "normal" in self._names:
            made["normal"] = normal.astype(np.float32)
        if "motion" in self._names:
            before, after = (
                self._camera.project(self._pixel_rays.carried(depth, part, poses, 0, k))[..., :2] for k in (1, 2)
            )
            made["motion"] = ((after - before) / ((around[2] - around[1]) * 1e-6)).astype(np.float32)
        return made


class PixelRays:
    """Rays through the middles of pixels: what they meet, and where that is at another time."""

    def __init__(self, params: Params, camera: Camera):
        self._camera, self._radius_m = camera, params.background.radius_m
        self._rays = camera.rays()
        self._object = surface_of(params)
        # How far from its place in a pinhole's image any pixel looks: triangles are sought that much farther around.
        x = self._rays[..., 0] * camera.focal_px + camera.width / 2 - (np.arange(camera.width) + 0.5)
        y = camera.height / 2 - self._rays[..., 1] * camera.focal_px - (np.arange(camera.height) + 0.5)[:, None]
        self._reach = np.array([np.abs(x).max(), np.abs(y).max()])
        self._travel_m: float | None = None

    def cast(self, poses: ScenePoses, index: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Depth, normal and part of what each ray meets at one of the poses."""
        depth, normal, part = (array.copy() for array in self._gripper(poses, index))
        origin, turn = poses.camera_position[index], poses.camera_rotation[index]

        def meet_body(surface: Surface, turned: np.ndarray, place: np.ndarray, number: int) -> None:
            axes = turn.T @ turned
            corners = (surface.vertices @ axes.T + turn.T @ (place - origin))[surface.faces]
            self._meet(corners, surface.normals @ axes.T, np.full(len(corners), number), depth, normal, part)

        meet_body(self._object, poses.object_rotation[index], poses.object_position[index], OBJECT)
        links = poses.links
        if links is not None:
            parts, arm = hulls(links.arm), posed(links, index)
            corners = ((arm.vertices - origin) @ turn)[arm.faces]
            self._meet(corners, arm.normals @ turn, parts.link_of_face + FIRST_LINK, depth, normal, part)
        for number, one in enumerate(poses.distractors, FIRST_DISTRACTOR):
            meet_body(one.shape.surface(), one.axes, one.places(poses.at_us[index]), number)
        rays = self._rays @ turn.T
        with np.errstate(divide="ignore"):
            table = np.where(rays[..., 2] < 0, -origin[2] / rays[..., 2], np.inf)
        a, b, c = np.sum(rays * rays, -1), rays @ origin, origin @ origin - self._radius_m**2
        sky = (np.sqrt(b * b - a * c) - b) / a
        for distance, kind, direction in ((table, SURFACE, turn.T @ [0.0, 0.0, 1.0]), (sky, SKY, np.zeros(3))):
            nearer = (distance < depth) & (distance > 0) & (distance <= sky)
            depth[nearer], normal[nearer], part[nearer] = distance[nearer], direction, kind
        return depth, normal, part

    def points(self, depth: np.ndarray) -> np.ndarray:
        """What the rays meet at these depths, in camera axes; of shape (height, width, 3)."""
        return self._rays * depth[..., None]

    def carried(self, depth: np.ndarray, part: np.ndarray, poses: ScenePoses, index: int, k: int) -> np.ndarray:
        """Places at pose k of the points that `cast` met at pose `index`, in the camera's axes there; of shape (height,
        width, 3)."""
        (before, start), (after, end) = (self._frames(poses, i) for i in (index, k))
        turns = after @ np.swapaxes(before, 1, 2)
        turns[np.all(before == after, (1, 2))] = np.eye(3)  # exact: what stands still has no motion
        return carry(self._rays, depth, part, turns, end - np.einsum("nij,nj->ni", turns, start))

    def _frames(self, poses: ScenePoses, index: int) -> tuple[np.ndarray, np.ndarray]:
        """Axes as columns (n, 3, 3) and origin (n, 3) of every part in the camera's axes."""
        links, distractors, camera = poses.links, poses.distractors, poses.mounted(self._camera, index)
        axes = np.tile(np.eye(3), (FIRST_DISTRACTOR + len(distractors), 1, 1))
        origin = np.zeros((len(axes), 3))
        axes[OBJECT], origin[OBJECT] = poses.object_rotation[index], poses.object_position[index]
        axes[SKY] = poses.background_turns[index]
        if links is not None:
            own = slice(FIRST_LINK, FIRST_LINK + links.turns.shape[1])
            axes[own], origin[own] = links.turns[index], links.places[index]
        for number, one in enumerate(distractors, FIRST_DISTRACTOR):
            origin[number] = one.places(poses.at_us[index])
        view = poses.camera_rotation[index]
        axes, origin = view.T @ axes, (origin - poses.camera_position[index]) @ view
        for number, side in ((HAND, 0.0), (LEFT, 1.0), (RIGHT, -1.0)):
            finger = np.array([0.0, side * float(poses.travel_m[index]), 0.0])
            axes[number], origin[number] = camera.rotation.T, (finger - camera.position) @ camera.rotation
        return axes, origin

    def _gripper(self, poses: ScenePoses, index: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Result of `cast` of the gripper alone, which stands still in the image while its opening stays the same and
        the camera does not tremble."""
        travel_m, camera = float(poses.travel_m[index]), poses.mounted(self._camera, index)
        if travel_m != self._travel_m or poses.mounts is not None:
            shape = self._rays.shape[:2]
            self._seen = np.full(shape, np.inf), np.zeros((*shape, 3)), np.full(shape, SKY, np.uint8)
            mesh, parts = assemble(travel_m, camera.fingers, camera.gripper)
            corners = (mesh.corners - camera.position) @ camera.rotation
            self._meet(corners, mesh.normals @ camera.rotation, parts.astype(np.int64), *self._seen)
            self._travel_m = travel_m if poses.mounts is None else None
        return self._seen

    def _meet(self, corners: np.ndarray, normals: np.ndarray, parts: np.ndarray, *seen: np.ndarray) -> None:
        """Put triangles into `seen`: depth, normal and part."""
        corners, normals = np.ascontiguousarray(corners), np.ascontiguousarray(normals)
        meet(self._rays, corners, normals, parts, self._camera.focal_px, self._reach, *seen)


@compiled(error_model="numpy")
def carry(rays, depth, part, turns, shifts):
    """Points at `depth` along the rays, (height, width, 3), moved by turn (n, 3, 3) and shift (n, 3) of their part."""
    moved = np.empty(rays.shape)
    for row in range(rays.shape[0]):
        for column in range(rays.shape[1]):
            number, away = part[row, column], depth[row, column]
            x, y, z = (rays[row, column, 0] * away, rays[row, column, 1] * away, rays[row, column, 2] * away)
            for k in range(3):
                turn = turns[number, k]
                moved[row, column, k] = turn[0] * x + turn[1] * y + turn[2] * z + shifts[number, k]
    return moved


@compiled(error_model="numpy")
def meet(rays, corners, normals, parts, focal, reach, depth, normal, part):
    """Put the triangles nearer than `depth` into depth, normal and part.

    rays (height, width, 3): from the origin, with z = -1, so that the way along them is the depth. corners, normals
    (n, 3, 3): in camera axes. reach (2,): farthest that a ray is from its place in a pinhole's image, in pixels. A ray
    passes a triangle on the inside of its three edges, each taken from its two corners alone: neighbours leave no gap.
    """
    height, width = depth.shape
    edge = np.empty((3, 3))
    for f in range(corners.shape[0]):
        left, right, top, bottom, ahead = 1e9, -1e9, 1e9, -1e9, True
        for k in range(3):
            away = -corners[f, k, 2]
            ahead = ahead and away > NEAR_M
            x, y = width * 0.5 + focal * corners[f, k, 0] / away, height * 0.5 - focal * corners[f, k, 1] / away
            left, right, top, bottom = min(left, x), max(right, x), min(top, y), max(bottom, y)
        if not ahead:
            if corners[f, 0, 2] > 0 and corners[f, 1, 2] > 0 and corners[f, 2, 2] > 0:
                continue
            left, right, top, bottom = 0.0, float(width), 0.0, float(height)
        left, right = max(left - reach[0] - 1.0, 0.0), min(right + reach[0] + 1.0, float(width))
        top, bottom = max(top - reach[1] - 1.0, 0.0), min(bottom + reach[1] + 1.0, float(height))
        for k in range(3):
            a, b = corners[f, (k + 1) % 3], corners[f, (k + 2) % 3]
            for i in range(3):
                edge[k, i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3]
        volume = corners[f, 0, 0] * edge[0, 0] + corners[f, 0, 1] * edge[0, 1] + corners[f, 0, 2] * edge[0, 2]
        for row in range(int(top), int(bottom)):
            for column in range(int(left), int(right)):
                x, y = rays[row, column, 0], rays[row, column, 1]
                a = x * edge[0, 0] + y * edge[0, 1] - edge[0, 2]
                b = x * edge[1, 0] + y * edge[1, 1] - edge[1, 2]
                c = x * edge[2, 0] + y * edge[2, 1] - edge[2, 2]
                if not ((a >= 0 and b >= 0 and c >= 0) or (a <= 0 and b <= 0 and c <= 0)):
                    continue
                total = a + b + c
                if total == 0:
                    continue
                distance = volume / total
                if 0 < distance < depth[row, column]:
                    depth[row, column] = distance
                    part[row, column] = parts[f]
                    length = 0.0
                    for i in range(3):
                        value = (a * normals[f, 0, i] + b * normals[f, 1, i] + c * normals[f, 2, i]) / total
                        normal[row, column, i] = value
                        length += value * value
                    for i in range(3):
                        normal[row, column, i] /= np.sqrt(length) + 1e-300
