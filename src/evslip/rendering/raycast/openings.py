"""The gripper at the openings of the fingers that a sample goes through."""

from collections import OrderedDict
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from evslip.rendering.camera import Camera
from evslip.rendering.geometry.displacement import Displaceable, nearest_step
from evslip.rendering.geometry.hand import Boxes, block_parts, blocking_boxes, shadow_boxes
from evslip.rendering.geometry.supersampling import OPEN
from evslip.rendering.raycast.gripper import fragment_points
from evslip.rendering.raycast.layers import Layers, displaceable, displaced, resolve
from evslip.rendering.scratch import make_scratch
from evslip.rendering.shadows.box_shadow import describe_boxes
from evslip.rendering.shadows.occlusion import openness

FINE_M, COARSE_M = 1e-4, 5e-4
"""Steps in which the finger travel is rounded: fine near the held one, coarse while the hand closes on nothing."""
HELD_M = 1e-3
"""Travel this close to the held one counts as holding."""
MEMORY_BYTES = 1 << 26
"""Bytes of all openings that are kept; at least two are."""


class Opening(NamedTuple):
    layers: Layers
    boxes: Boxes
    """Shadow boxes in camera axes."""
    blockers: Boxes
    """`hand.blocking_boxes`, in camera axes."""


class Openings:
    """Resolves each opening once for each place of the camera on the hand. The gripper's image depends on these and on
    the rounded travel alone, not on what came before."""

    def __init__(self, camera: Camera, held_m: float):
        """held_m: mean finger travel around which openings are rounded, so that a held grip stays one opening."""
        self._camera, self._held_m = camera, held_m
        self._kept: OrderedDict[tuple[Any, ...], Any] = OrderedDict()

    def at(self, travel_m: float, camera: Camera | None = None) -> Opening:
        """The gripper at a mean travel of the two fingers, which mirror each other. camera: the same where vibration
        holds it."""
        rounded, camera = float(self.rounded(np.array(travel_m))), camera or self._camera
        return self._once(_resolve, rounded, camera)

    def about(self, travel_m: float, camera: Camera) -> Opening:
        """`at` within a fraction of a sample, for a fraction of the price: made of what a camera sees that is
        displaced by whole steps."""
        rounded = float(self.rounded(np.array(travel_m)))
        still = self._once(_displaceable, rounded, self._camera)
        stepped = nearest_step(self._camera, camera, still)
        still = still if stepped is self._camera else self._once(_displaceable, rounded, stepped)

        def make(camera: Camera, travel_m: float) -> Opening:
            return Opening(displaced(still, camera), *_boxes(camera, travel_m))

        return self._once(make, rounded, camera, "displaced")

    def _once(self, make: Callable[[Camera, float], Any], travel_m: float, camera: Camera, kind: Any = None) -> Any:
        key = kind or make, travel_m, camera.position.tobytes(), camera.rotation.tobytes()
        if key in self._kept:
            self._kept.move_to_end(key)
            return self._kept[key]
        made = self._kept[key] = make(camera, travel_m)
        most = max(4, MEMORY_BYTES // (getattr(made, "layers", made).fragments.nbytes + 1))
        while len(self._kept) > most:
            self._kept.popitem(last=False)
        return made

    def rounded(self, travel_m: np.ndarray) -> np.ndarray:
        """The travels at which the gripper is resolved."""
        away = travel_m - self._held_m
        step = np.where(np.abs(away) < HELD_M, FINE_M, COARSE_M)
        return self._held_m + np.round(away / step) * step


def _resolve(camera: Camera, travel_m: float) -> Opening:
    boxes, blockers = _boxes(camera, travel_m)
    layers = resolve(camera, travel_m)
    layers.fragments[OPEN] = _open_share(camera, layers.fragments, blockers)
    return Opening(layers, boxes, blockers)


def _displaceable(camera: Camera, travel_m: float) -> Displaceable:
    still = displaceable(camera, travel_m)
    fragments = np.ascontiguousarray(still.fragments.T)
    still.fragments[:, OPEN] = _open_share(camera, fragments, _boxes(camera, travel_m)[1])
    return still


def _open_share(camera: Camera, fragments: np.ndarray, blockers: Boxes) -> np.ndarray:
    """`OPEN` of fragments (ROWS, n)."""
    points = fragment_points(fragments)
    rows, parts = describe_boxes(blockers, np.zeros(3)), block_parts(camera.fingers).astype(np.float32)
    own = points.places, points.normals, points.parts
    return openness(make_scratch(), *own, rows, parts, False)


def _boxes(camera: Camera, travel_m: float) -> tuple[Boxes, Boxes]:
    gripper = travel_m, camera.fingers, camera.gripper
    return _turned(camera, shadow_boxes(*gripper)), _turned(camera, blocking_boxes(*gripper))


def _turned(camera: Camera, boxes: Boxes) -> Boxes:
    turn = camera.rotation.T
    return Boxes(turn @ boxes.turns, (boxes.places - camera.position) @ turn.T, boxes.halves)
