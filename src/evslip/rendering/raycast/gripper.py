"""Shading of the gripper's fragments, and the order of gripper and object in each pixel."""

import numpy as np

from evslip.rendering import slots
from evslip.rendering.geometry.simd_minmax import larger, smaller
from evslip.rendering.raycast import layers
from evslip.rendering.raycast.layers import BODY, NORMAL_X, NORMAL_Y, NORMAL_Z, SHARE, VIEW_X, VIEW_Y, VIEW_Z, X, Y, Z
from evslip.rendering.scratch import ONE, ZERO, f32, kernel
from evslip.rendering.shading.ambient import irradiance
from evslip.rendering.shading.illumination import illuminate
from evslip.rendering.shading.surface_light import from_lamp, luminance
from evslip.rendering.shadows.box_shadow import BOX, describe_box
from evslip.rendering.shadows.casters import shade
from evslip.rendering.shadows.occlusion import block, faces_any
from evslip.rendering.slots import AMBIENT, LIT, OPEN, PART, RESULT, ROOM, SCRATCH, SEEN, SLOT, U, V, W
from evslip.utils.refcount import without_refcount

TOUCHING_M = 0.0015
"""A fragment this far behind the object's near face still counts as in front: pads sink into a soft contact."""


@kernel
def shade_gripper(scratch, values, view, setting, gloss, fragments, albedo, casters):
    """values (n,): luminance of every fragment.

    view: `viewpoint.View`; setting: `setting.Setting`; albedo: row of the fragments' colour. A part of the gripper
    casts no shadow on itself.
    """
    S, light = scratch.slots, illuminate(view, setting, casters, distance_of(view, casters))
    _shade_all(S, values, fragments, albedo, light, f32(gloss), _open_to_object(S, fragments, light.blockers[0]))


@kernel
def distance_of(view, casters):
    """Distance of the object before the camera, in metres."""
    away = 0.0
    for j in range(3):
        away -= view.turn[j, 2] * (casters.origin[j] - view.camera[j])
    return away


@kernel
def _shade_all(S, values, fragments, albedo, light, gloss, opens):
    S, values, fragments, light = without_refcount((S, values, fragments, light))
    kinds = light.reception.kinds
    for start in range(0, fragments.shape[1], SLOT):
        n = min(SLOT, fragments.shape[1] - start)
        own = fragments[:, start : start + n]
        first, last = own[BODY, 0], own[BODY, 0]
        for i in range(n):
            first, last = smaller(first, own[BODY, i]), larger(last, own[BODY, i])
            S[OPEN + i] = opens[start + i]
        for k in range(kinds.shape[0]):  # casters of the fragments' own part need not be asked
            kinds[k, 0] = first != last or f32(kinds[k, 2]) != first
        shade_fragments(S, n, own, albedo, light, gloss)
        for i in range(n):
            values[start + i] = S[RESULT + i]


@kernel
def shade_fragments(S, n, own, albedo, light, gloss):
    """RESULT of n fragments, columns of `Layers.fragments`, whose OPEN is known."""
    _light(S, n, own, albedo, light, gloss)
    lit = ZERO
    for i in range(n):
        lit = larger(lit, S[LIT + i])
        S[PART + i] = own[BODY, i]
    if lit > ZERO:
        shade(S, n, light.reception, True, False)
    for i in range(n):
        # Their colour is in both lights already.
        S[RESULT + i] = luminance(ONE, S[AMBIENT + i], S[OPEN + i], S[LIT + i], S[SEEN + i], ZERO)


@kernel
def open_layers(fragments, turns, places, halves, parts):
    """Fill in row OPEN of fragments. turns, places, halves: boxes of the gripper's `parts`, in camera axes."""
    S, boxes = np.zeros(SCRATCH, np.float32), np.zeros((places.shape[0], BOX), np.float32)
    for k in range(places.shape[0]):
        describe_box(boxes[k], np.eye(3), np.zeros(3), turns[k], places[k], halves[k], np.zeros(3))
    for start in range(0, fragments.shape[1], SLOT):
        n = min(SLOT, fragments.shape[1] - start)
        own = fragments[:, start : start + n]
        own[layers.OPEN] = ONE
        _place(S, n, own)
        for k in range(places.shape[0]):
            if not faces_any(S, n, boxes[k]):
                continue
            for i in range(n):
                S[OPEN + i] = ONE
            block(S, n, boxes[k], False)
            for i in range(n):
                own[layers.OPEN, i] *= ONE if own[BODY, i] == parts[k] else S[OPEN + i]


@kernel
def _open_to_object(S, fragments, box):
    """Share of the light from all around that reaches each fragment past the object and the other parts, (n,)."""
    opens, where, count = fragments[layers.OPEN].copy(), np.empty(fragments.shape[1], np.int64), 0
    m00, m01, m02, m10, m11, m12, m20, m21, m22 = box[0], box[1], box[2], box[3], box[4], box[5], box[6], box[7], box[8]
    for k in range(opens.size):
        p, q, r = fragments[NORMAL_X, k], fragments[NORMAL_Y, k], fragments[NORMAL_Z, k]
        u, v, w = fragments[X, k], fragments[Y, k], fragments[Z, k]
        a, b, c = m00 * p + m01 * q + m02 * r, m10 * p + m11 * q + m12 * r, m20 * p + m21 * q + m22 * r
        x = m00 * u + m01 * v + m02 * w + box[9]
        y = m10 * u + m11 * v + m12 * w + box[10]
        z = m20 * u + m21 * v + m22 * w + box[11]
        # The box's highest corner over the fragment's horizon.
        if abs(a) * box[15] + abs(b) * box[16] + abs(c) * box[17] > a * x + b * y + c * z:
            where[count] = k
            count += 1
    for start in range(0, count, SLOT):
        n = min(SLOT, count - start)
        for i in range(n):
            k = where[start + i]
            S[U + i], S[V + i], S[W + i] = fragments[X, k], fragments[Y, k], fragments[Z, k]
            S[slots.NORMAL_X + i], S[slots.NORMAL_Y + i] = fragments[NORMAL_X, k], fragments[NORMAL_Y, k]
            S[slots.NORMAL_Z + i], S[OPEN + i] = fragments[NORMAL_Z, k], opens[k]
        block(S, n, box, False)
        for i in range(n):
            opens[where[start + i]] = S[OPEN + i]
    return opens


@kernel
def _place(S, n, own):
    for i in range(n):
        S[U + i], S[V + i], S[W + i], S[OPEN + i] = own[X, i], own[Y, i], own[Z, i], own[layers.OPEN, i]
        S[slots.NORMAL_X + i], S[slots.NORMAL_Y + i] = own[NORMAL_X, i], own[NORMAL_Y, i]
        S[slots.NORMAL_Z + i] = own[NORMAL_Z, i]


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
def _light(S, n, own, albedo, light, gloss):
    """U, V, W; SEEN = ROOM = 1; AMBIENT = light from all around and LIT = light from the lamp, both of their colour."""
    l0, l1, l2, ambient = light.lamp[0], light.lamp[1], light.lamp[2], light.ambient
    for i in range(n):
        x, y, z = own[X, i], own[Y, i], own[Z, i]
        S[U + i], S[V + i], S[W + i], S[SEEN + i], S[ROOM + i] = x, y, z, ONE, ONE
        towards, normal = (l0 - x, l1 - y, l2 - z), (own[NORMAL_X, i], own[NORMAL_Y, i], own[NORMAL_Z, i])
        view = own[VIEW_X, i], own[VIEW_Y, i], own[VIEW_Z, i]
        lit, shine = from_lamp(light.power, light.radius, towards, normal, view)
        S[LIT + i] = lit * (own[albedo, i] + gloss * shine)
        S[AMBIENT + i] = own[albedo, i] * irradiance(ambient, normal[0], normal[1], normal[2])


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
