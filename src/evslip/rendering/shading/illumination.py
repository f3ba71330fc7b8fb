"""Light in one frame, in camera axes, and how it falls on the points of a body."""

from typing import NamedTuple

import numpy as np

from evslip.rendering.geometry.hand import Boxes
from evslip.rendering.materials.paint import Finish, Gloss
from evslip.rendering.raycast.setting import Setting
from evslip.rendering.scratch import Scratch, kernel
from evslip.rendering.shading.highlights import finished_light, mirror_points
from evslip.rendering.shading.surface_light import light_points, received_light
from evslip.rendering.shadows.box_shadow import describe_boxes
from evslip.rendering.shadows.casters import Casters, Patches, lamp_share
from evslip.rendering.shadows.occlusion import openness
from evslip.rendering.viewpoint import View


class Illumination(NamedTuple):
    lamp: np.ndarray
    """Its centre, float32 (3,)."""
    radius: np.float32
    power: np.float32
    """Luminance x radius^2 of what stands above the surface's horizon."""
    ambient: np.ndarray
    """Quadratic form of the light from all around, float32 (4, 4)."""
    casters: Casters
    blockers: np.ndarray
    """Boxes that keep light from all around away, of `describe_boxes`: the object first."""
    blocker_parts: np.ndarray
    """The body that each belongs to, float32."""
    standing: np.ndarray
    """Boxes that stand on the surface and keep light from all around away from it alone, of `describe_boxes`."""


class BodyPoints(NamedTuple):
    """Places on a body, each of which lights a share of a pixel."""

    places: np.ndarray
    """In camera axes, float32 (3, n)."""
    normals: np.ndarray
    """Unit vectors, float32 (3, n)."""
    rooms: np.ndarray
    """Share of the pixel that each stands for, over which shadows are blurred, float32 (n,)."""
    parts: np.ndarray
    """Number of the body, float32 (n,)."""


def illuminate(
    view: View, sky_turn: np.ndarray, setting: Setting, casters: Casters, blockers: Boxes, parts: np.ndarray,
    standing: Boxes,
) -> Illumination:  # fmt: skip
    """The light of a frame; sky_turn: the camera's axes in those of the background; blockers: in camera axes, of the
    bodies `parts`; standing: of `Illumination`."""
    lamp = setting.lamp
    centre = view.turn.T @ (lamp.position - view.camera)
    turn = np.eye(4)
    turn[:3, :3] = sky_turn
    power = np.float32(lamp.luminance * lamp.radius_m**2 * lamp.share)
    boxes = describe_boxes(blockers, centre)
    matrix = (turn.T @ setting.ambient.matrix @ turn).astype(np.float32)
    lit = centre.astype(np.float32), np.float32(lamp.radius_m), power, matrix, casters
    return Illumination(*lit, boxes, parts.astype(np.float32), describe_boxes(standing, centre))


def one_patch(count: int, step_m: float) -> Patches:
    """All points of a body, in no plane, that is so far away that a pixel is `step_m` wide."""
    steps = np.array([[[step_m, 0.0, 0.0], [0.0, step_m, 0.0]]])
    return Patches(np.array([0, count]), steps, np.array([[0.0, 0.0, 0.0, -1.0]]))


def light_body(
    scratch: Scratch, light: Illumination, points: BodyPoints, opened: np.ndarray, patches: Patches, gloss: Gloss
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Light that points of a body receive, and that they mirror, as of `received_light`. opened (n,): share of the
    light from all around that reaches them."""
    strength = light.lamp, light.power, light.radius, light.ambient
    around, lit, shine = light_points(points.places, points.normals, *strength)
    own = points.places, points.rooms, points.parts, lit
    seen = lamp_share(scratch, light.casters, *own, patches, True)
    if not isinstance(gloss, Finish):
        return received_light(around, opened, lit, seen, np.float32(gloss) * shine * lit)
    bulb, lamp = (light.lamp, light.radius), lit * seen
    mirrors = mirror_points(points.places, points.normals, *bulb, light.ambient, np.float32(gloss.roughness))
    return finished_light(gloss, around * opened + lamp, lamp, opened, mirrors)


def open_body(scratch: Scratch, light: Illumination, points: BodyPoints) -> np.ndarray:
    """Share of the light from all around that the blockers leave to points, float32 (n,)."""
    boxes = light.blockers, light.blocker_parts
    return openness(scratch, points.places, points.normals, points.parts, *boxes, False)


@kernel
def add_points(out, keep, pixels, shares, values):
    """Add points of a body to their pixels: shares (n,) of the flat indices `pixels` (n,), times what `keep` (height,
    width) leaves of each."""
    flat, kept = out.reshape(-1), keep.reshape(-1)
    for i in range(pixels.size):
        flat[pixels[i]] += shares[i] * kept[pixels[i]] * values[i]
