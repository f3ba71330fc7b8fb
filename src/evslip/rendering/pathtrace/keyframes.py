"""Frames between traced ones: light is carried along with the points that send it, whose motion is known exactly."""

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy.ndimage import map_coordinates, spline_filter

from evslip.config.params import Params
from evslip.rendering.camera import Camera
from evslip.rendering.outputs import PixelRays
from evslip.rendering.pathtrace.mitsuba_scene import MitsubaScene
from evslip.rendering.poses import ScenePoses
from evslip.rendering.timing.schedule import image_motion

SAME_DEPTH = 0.01
"""Share by which the depth of a point may differ from what a traced frame shows in its place, to be the same one."""
LEAST = 1e-6
"""Weight of a traced frame that only counts where the other one does not show a point."""
AROUND = 3
"""Denoised frames before and after one that are averaged with it where the image stands still: on what is held. What
the denoiser makes of other noise differs there by 3 % from frame to frame, the light itself by half a percent."""
STILL_PX = 0.05
HOLE_SPP = 64
"""Least paths of single pixels beside denoised frames: they cannot be denoised."""
ORDER = 3
"""Order of the splines between pixels."""


class Key(NamedTuple):
    """A traced frame."""

    image: np.ndarray
    """Linear RGB, of shape (height, width, 3)."""
    splines: list[np.ndarray]
    """Coefficients of its channels."""
    depth: np.ndarray
    part: np.ndarray


class KeyframePlan(NamedTuple):
    """Frames of a sequence that are traced."""

    places: np.ndarray
    """Place of every frame among the traced ones, (n,): whole numbers at those, and shares of the way between."""
    keys: np.ndarray
    """Indices of the traced ones."""


class Keyframes:
    """Traces some frames of a sequence and makes the others from the two around them."""

    def __init__(self, params: Params, camera: Camera, scene: MitsubaScene):
        """camera: a pinhole on the hand."""
        self._params, self._camera, self._scene = params, camera, scene
        self._pixel_rays, self._spp = PixelRays(params, camera), params.render.spp
        self._hole_spp = max(self._spp, HOLE_SPP) if params.render.denoise else self._spp
        self._poses: ScenePoses | None = None
        self._plan = KeyframePlan(np.zeros(1), np.zeros(1, np.int64))
        self._keys: dict[int, Key] = {}
        self._traces: dict[int, np.ndarray] = {}

    def draw(self, poses: ScenePoses, index: int) -> np.ndarray:
        """Linear RGB in cd/m2, of shape (height, width, 3). Which frames are traced depends on all the poses alone."""
        if poses is not self._poses:
            self._poses, self._keys, self._traces = poses, {}, {}
            motion = image_motion(poses, self._camera, self._params)
            self._plan = plan_keyframes(motion, self._params.render.key_motion_px)
        keys = self._plan.keys
        after = int(keys[np.searchsorted(keys, index)])
        if after == index:
            return self._key(poses, index).image
        before = int(keys[np.searchsorted(keys, index) - 1])
        return self._between(poses, index, before, after)

    def _key(self, poses: ScenePoses, index: int) -> Key:
        if index not in self._keys:
            if len(self._keys) > 1:
                del self._keys[min(self._keys)]
            depth, _, part = self._pixel_rays.cast(poses, index)
            image = self._steadied(poses, index, depth, part)
            single: Any = np.float32
            splines = [spline_filter(np.ascontiguousarray(image[..., k]), ORDER, single) for k in range(3)]
            self._keys[index] = Key(image, splines, depth, part)
        return self._keys[index]

    def _rendered(self, poses: ScenePoses, index: int) -> np.ndarray:
        if index not in self._traces:
            if len(self._traces) > 2 * AROUND + 1:
                del self._traces[min(self._traces)]
            self._scene.show(poses, index)
            self._traces[index] = self._scene.render(self._spp)
        return self._traces[index]

    def _steadied(self, poses: ScenePoses, index: int, depth: np.ndarray, part: np.ndarray) -> np.ndarray:
        """A traced frame; if it is denoised, the mean of it and its neighbours where the image stands still."""
        if not self._params.render.denoise:
            return self._rendered(poses, index)
        keys = self._plan.keys
        number = int(np.searchsorted(keys, index))
        total, count = self._rendered(poses, index).astype(np.float64), np.ones((*depth.shape, 1))
        row, column = np.mgrid[0.5 : depth.shape[0], 0.5 : depth.shape[1]]
        for other in keys[max(0, number - AROUND) : number + AROUND + 1].tolist():
            if other != index:
                there = self._camera.project(self._pixel_rays.carried(depth, part, poses, index, other))
                still = np.hypot(there[..., 0] - column, there[..., 1] - row)[..., None] < STILL_PX
                total += np.where(still, self._rendered(poses, other), 0.0)
                count += still
        return (total / count).astype(np.float32)

    def _between(self, poses: ScenePoses, index: int, before: int, after: int) -> np.ndarray:
        depth, _, part = self._pixel_rays.cast(poses, index)
        share = self._plan.places[index] - self._plan.places[before]
        total, weight = np.zeros((*depth.shape, 3), np.float32), np.zeros(depth.shape, np.float32)
        for k, own in ((before, 1 - share), (after, share)):
            key = self._key(poses, k)
            there = self._camera.project(self._pixel_rays.carried(depth, part, poses, index, k))
            seen = np.float32(max(own, LEAST)) * shown(there, part, key)
            row, column = there[..., 1] - 0.5, there[..., 0] - 0.5
            for channel, spline in enumerate(key.splines):
                found = map_coordinates(spline, [row, column], order=ORDER, mode="nearest", prefilter=False)
                total[..., channel] += seen * np.maximum(found, 0)
            weight += seen
        holes = np.argwhere(weight == 0)
        image = total / np.maximum(weight, 1e-9)[..., None]
        if len(holes):
            image[tuple(holes.T)] = self._trace(poses, index, holes)
        return image

    def _trace(self, poses: ScenePoses, index: int, pixels: np.ndarray) -> np.ndarray:
        """Pixels (n, 2), row and column, traced one by one; (n, 3)."""
        self._scene.show(poses, index)
        camera = self._camera
        places = pixels[:, None] + np.random.default_rng(0).random((len(pixels), self._hole_spp, 2))
        x = (places[..., 1] - camera.width / 2) / camera.focal_px
        y = (camera.height / 2 - places[..., 0]) / camera.focal_px
        rays = np.stack([x, y, -np.ones_like(x)], -1) @ poses.camera_rotation[index].T
        return self._scene.render_pixels(rays, self._hole_spp)


def shown(there: np.ndarray, part: np.ndarray, key: Key) -> np.ndarray:
    """Whether a traced frame shows points, bool (height, width): there (height, width, 3) are their places and depths
    in it, `part` what they belong to."""
    height, width = key.depth.shape
    column, row = (np.clip(there[..., k], -1, 1 << 20).astype(np.int64) for k in (0, 1))
    inside = (column >= 0) & (column < width) & (row >= 0) & (row < height) & (there[..., 2] > 0)
    row, column = np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)
    near = np.abs(key.depth[row, column] - there[..., 2]) < SAME_DEPTH * there[..., 2]
    return inside & near & (key.part[row, column] == part)


def plan_keyframes(motion_px: np.ndarray, most_px: float) -> KeyframePlan:
    """A plan in which no two traced frames are more than `most_px` apart, unless no frame lies between; the first and
    the last are traced. motion_px (n - 1,): from frame to frame."""
    along = np.concatenate([[0.0], np.cumsum(motion_px)])
    keys = [0]
    while keys[-1] < len(along) - 1:
        reach = int(np.searchsorted(along, along[keys[-1]] + most_px, side="right")) - 1
        keys.append(min(max(reach, keys[-1] + 1), len(along) - 1))
    places = np.zeros(len(along))
    for number, (first, last) in enumerate(pairwise(keys)):
        way = along[first : last + 1] - along[first]
        places[first : last + 1] = number + (way / way[-1] if way[-1] > 0 else np.linspace(0, 1, len(way)))
    return KeyframePlan(places, np.array(keys))
