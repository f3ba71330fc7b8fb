"""Shading of the gripper's fragments, and the order of gripper and object in each pixel."""

import numpy as np

from evslip.rendering.geometry.supersampling import BODY, NORMAL_X, NORMAL_Z, OPEN, SHARE, X, Y, Z
from evslip.rendering.scratch import ONE, ZERO, Scratch, f32, kernel
from evslip.rendering.shading.illumination import BodyPoints, Illumination, light_body, one_patch
from evslip.rendering.shadows.occlusion import openness

TOUCHING_M = 0.0015
"""A fragment this far behind the object's near face still counts as in front: pads sink into a soft contact."""


def shade_gripper(
    scratch: Scratch, light: Illumination, fragments: np.ndarray, albedo: int, gloss: float, step_m: float
) -> np.ndarray:
    """Luminance of every fragment, float32 (n,). albedo: row of their colour; step_m: width of a pixel where the object
    is. A part of the gripper casts no shadow on itself."""
    points = fragment_points(fragments)
    own = light.blockers[:1], light.blocker_parts[:1]
    opened = fragments[OPEN] * openness(scratch, points.places, points.normals, points.parts, *own, False)
    patch = one_patch(fragments.shape[1], step_m)
    received, mirrored = light_body(scratch, light, points, opened, patch, gloss)
    return fragments[albedo] * received + mirrored


def fragment_points(fragments: np.ndarray) -> BodyPoints:
    """Columns of `Layers.fragments` as points of a body."""
    ones = np.ones(fragments.shape[1], np.float32)
    return BodyPoints(fragments[X : Z + 1], fragments[NORMAL_X : NORMAL_Z + 1], ones, fragments[BODY])


@kernel
def order_by_faces(front, fragments, place, axes, half):
    """front (n,): 1 for fragments on the camera's side of any face of a box, 0 for those behind. The box's pose is
    given in camera axes."""
    planes = _near_faces(axes, place, half)
    for i in range(front.size):
        inside = f32(-1e9)
        for k in range(3):
            x, y, z = fragments[X, i], fragments[Y, i], fragments[Z, i]
            ahead = planes[k, 0] * x + planes[k, 1] * y + planes[k, 2] * z - planes[k, 3]
            inside = max(inside, ahead)
        front[i] = ONE if inside > f32(-TOUCHING_M) else ZERO


@kernel
def order_by_depth(front, fragments, pixels, starts, near):
    """front (n,): 1 for fragments that are nearer than the object; near (height, width): 1 / its depth, 0 for none."""
    flat = near.reshape(-1)
    for m in range(pixels.size):
        inverse = flat[pixels[m]]
        for k in range(starts[m], starts[m + 1]):
            front[k] = ONE if (-fragments[Z, k] - f32(TOUCHING_M)) * inverse < ONE else ZERO


@kernel
def merge_gripper(light, clear, keep, over, values, front, fragments, pixels, starts):
    """Put the fragments behind the object before what `light` and `clear` of a `ForegroundLayer` hold. keep (height,
    width): share of each pixel without fragments in front; over (m,): the light of those in front, per pixel of
    `pixels`."""
    flat, free, kept = light.reshape(-1), clear.reshape(-1), keep.reshape(-1)
    for m in range(pixels.size):
        behind, ahead, share, share_ahead = ZERO, ZERO, ZERO, ZERO
        for k in range(starts[m], starts[m + 1]):
            part = fragments[SHARE, k]
            share += part
            share_ahead += part * front[k]
            ahead += part * front[k] * values[k]
            behind += part * (ONE - front[k]) * values[k]
        rest = max(ZERO, ONE - share)
        flat[pixels[m]] = flat[pixels[m]] * rest + behind
        free[pixels[m]] *= rest
        kept[pixels[m]] = max(ZERO, ONE - share_ahead)
        over[m] = ahead


@kernel
def dim_behind(light, clear, total, touched):
    """Dim what stands behind a body by its coverage."""
    for row in range(light.shape[0]):
        for column in range(touched[row, 0], touched[row, 1]):
            rest = max(ZERO, ONE - total[row, column])
            light[row, column] *= rest
            clear[row, column] *= rest


@kernel
def add_front(light, bodies, keep, total, touched, over, front, fragments, pixels, starts):
    """Add the fragments in front of the object, and mark in `bodies` what covers most of each pixel."""
    flat, marks, kept, covered = light.reshape(-1), bodies.reshape(-1), keep.reshape(-1), total.reshape(-1)
    for row in range(light.shape[0]):
        for column in range(touched[row, 0], touched[row, 1]):
            if total[row, column] >= f32(0.5):
                bodies[row, column] = 2
    for m in range(pixels.size):
        p = pixels[m]
        flat[p] += over[m]
        gripper = ZERO
        for k in range(starts[m], starts[m + 1]):
            gripper += fragments[SHARE, k] * (front[k] + (ONE - front[k]) * (ONE - covered[p]))
        body = covered[p] * kept[p]
        if gripper >= max(body, ONE - gripper - body):
            marks[p] = 3


@kernel
def _near_faces(axes, place, half):
    """Planes (3, 4) of the faces turned to the camera at the origin: n . p - d > 0 in front; 0 . p - 1e9 for none."""
    planes = np.zeros((3, 4), np.float32)
    for axis in range(3):
        away = 0.0
        for j in range(3):
            away -= axes[j, axis] * place[j]
        if abs(away) <= half[axis]:
            planes[axis, 3] = f32(1e9)
            continue
        sign = 1.0 if away > 0 else -1.0
        for j in range(3):
            planes[axis, j] = f32(sign * axes[j, axis])
        planes[axis, 3] = f32(half[axis] - sign * away)
    return planes
