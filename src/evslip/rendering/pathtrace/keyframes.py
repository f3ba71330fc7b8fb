"""Frames between traced ones: light is carried along with the points that send it, whose motion is known exactly."""

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy.ndimage import spline_filter

from evslip.config.params import Params
from evslip.rendering.camera import Camera
from evslip.rendering.outputs import PixelRays
from evslip.rendering.pathtrace.mitsuba_scene import MitsubaScene
from evslip.rendering.pathtrace.reprojection import View, fill, gather
from evslip.rendering.poses import ScenePoses
from evslip.rendering.raycast.setting import channel_of
from evslip.rendering.timing.schedule import image_motion

LEAST = 1e-6
"""Weight of a traced frame that only counts where the other one does not show a point."""
AROUND = 3
"""Denoised frames before and after one that are averaged with it where the image stands still: on what is held. What
the denoiser makes of other noise differs there by 3 % from frame to frame, the light itself by half a percent."""
STILL_PX = 0.05
ORDER = 3
"""Order of the splines between pixels."""


class Key(NamedTuple):
    image: np.ndarray
    """Of shape (height, width, channels)."""
    splines: np.ndarray
    """Coefficients of its channels, of shape (channels, height, width)."""
    view: View


class KeyframePlan(NamedTuple):
    """Frames of a sequence that are traced."""

    places: np.ndarray
    """Place of every frame among the traced ones, (n,): whole numbers at those, and shares of the way between."""
    keys: np.ndarray
    """Indices of the traced ones."""


class Keyframes:
    """Traces some frames of a sequence and makes the others from the two around them."""

    def __init__(self, params: Params, camera: Camera, scene: MitsubaScene, channel: int | None = None):
        """camera: a pinhole on the hand; channel: as of `channel_of`, None for linear RGB."""
        self._params, self._camera, self._scene, self._channel = params, camera, scene, channel
        self._pixel_rays, self._spp = PixelRays(params, camera), params.render.spp
        self._poses: ScenePoses | None = None
        self._plan = KeyframePlan(np.zeros(1), np.zeros(1, np.int64))
        self._keys: dict[int, Key] = {}
        self._traces: dict[int, np.ndarray] = {}

    def draw(self, poses: ScenePoses, index: int) -> np.ndarray:
        """Light in cd/m2, float32 of shape (height, width), or (height, width, 3) for linear RGB. Which frames are
        traced depends on all the poses alone."""
        if poses is not self._poses:
            self._poses, self._keys, self._traces = poses, {}, {}
            motion = image_motion(poses, self._camera, self._params)
            self._plan = plan_keyframes(motion, self._params.render.key_motion_px)
        keys = self._plan.keys
        after = int(keys[np.searchsorted(keys, index)])
        if after == index:
            image = self._key(poses, index).image
        else:
            image = self._between(poses, index, int(keys[np.searchsorted(keys, index) - 1]), after)
        return image if self._channel is None else image[..., 0]

    def _key(self, poses: ScenePoses, index: int) -> Key:
        if index not in self._keys:
            if len(self._keys) > 1:
                del self._keys[min(self._keys)]
            depth, normal, part = self._pixel_rays.cast(poses, index)
            image = self._steadied(poses, index, depth, part)
            single: Any = np.float32
            splines = np.stack([spline_filter(channel, ORDER, single) for channel in np.moveaxis(image, -1, 0)])
            self._keys[index] = Key(image, splines, View(self._pixel_rays.points(depth), normal, part))
        return self._keys[index]

    def _rendered(self, poses: ScenePoses, index: int) -> np.ndarray:
        """A traced frame, of shape (height, width, channels)."""
        if index not in self._traces:
            if len(self._traces) > 2 * AROUND + 1:
                del self._traces[min(self._traces)]
            self._scene.show(poses, index)
            image = self._scene.render(self._spp)
            self._traces[index] = image if self._channel is None else channel_of(image, self._channel)[..., None]
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
        channels = 3 if self._channel is None else 1
        total, weight = np.zeros((*depth.shape, channels), np.float32), np.zeros(depth.shape, np.float32)
        for k, own in ((before, 1 - share), (after, share)):
            key = self._key(poses, k)
            moved = self._pixel_rays.carried(depth, part, poses, index, k)
            places = self._camera.project(moved)
            gather(key.splines, *key.view, moved, places, part, max(own, LEAST), total, weight)
        image = total / np.maximum(weight, np.float32(1e-12))[..., None]
        fill(image, part, weight > 0)
        return image


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
