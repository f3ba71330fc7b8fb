"""The shadow of a mesh: the lamp's disc, cut by the mesh's outline as the lamp sees it.

A lamp is small seen from what it lights, so the edges that can hide part of it are those where the mesh turns away from
the lamp's centre. From a point in shadow, each such edge is a line in front of the lamp's disc; all of them close to
outlines, and the hidden share is the outlines' area on the disc: summed edge by edge in strips across the disc, as the
silhouettes of `coverage` are summed in the pixels of a row.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from evslip.rendering.scratch import HALF, ONE, ZERO, f32, formula, kernel
from evslip.rendering.shadows.box_shadow import extent
from evslip.rendering.slots import BLUR, HIDDEN, LAMP_X, LAMP_Y, LAMP_Z, PER_DEPTH, ROOM, STRETCH, U, V, W

TINY = f32(1e-9)
STEEP = f32(0.02)
"""An edge that crosses less of a strip's width than this has its middle's value."""
PIXEL_BLUR = 0.5
"""Radius of the disc that stands for a pixel."""
INNER, OUTER = f32(0.9566115), f32(0.6141848)
"""Mean half chords of the unit disc over heights 0 to 1/2 and 1/2 to 1."""
PER_DISC = f32(1 / math.pi)
ANY = (0.3, 0.5, 0.81)
"""A direction for want of any other."""
DEPTH_M = 0.004
"""Over this depth a receiver passes from the lit side of an outline to its shadow."""


class Outlines(NamedTuple):
    """Edges of meshes as their lamp sees them, each in a frame of its own: origin in the mesh, third axis towards the
    lamp."""

    edges: np.ndarray
    """Both ends of every edge, of all of them, float32 of shape (m, 2, 3)."""
    starts: np.ndarray
    """First edge of each, then m; int64 (o + 1,)."""
    frames: np.ndarray
    """Axes of the frames as columns, (o, 3, 3)."""
    origins: np.ndarray
    """(o, 3)."""
    planes: np.ndarray
    """(a, b, c) of each: it lies about at depth a x + b y + c; (o, 3)."""


class Solid(NamedTuple):
    """A closed mesh that casts a shadow: arrays of `Facets`."""

    vertices: np.ndarray
    planes: np.ndarray
    edges: np.ndarray


def outlines_of(
    solids: Sequence[Solid], places: np.ndarray, turns: np.ndarray, lamp: np.ndarray, level: np.ndarray
) -> Outlines:
    """Outlines of meshes at places (o, 3) with axes (o, 3, 3). level (3,): horizontal part of the direction of view,
    along which pixels stretch on the surface."""
    frames, planes = lamp_frames(places, lamp, level), np.zeros((len(places), 3))
    edges = [np.zeros((0, 2, 3), np.float32)]
    for k, solid in enumerate(solids):
        found, planes[k] = silhouette(*solid, turns[k].T @ (lamp - places[k]), turns[k].T @ frames[k])
        edges.append(found)
    starts = np.cumsum([len(part) for part in edges])
    return Outlines(np.concatenate(edges), starts, frames, places, planes)


@kernel
def lamp_frames(places, lamp, level):
    """Axes of the lamp's frames at places (o, 3) as columns, (o, 3, 3): the third towards the lamp, the second along
    `level` (3,)."""
    frames = np.empty((places.shape[0], 3, 3))
    for k in range(places.shape[0]):
        towards = lamp - places[k]
        towards /= math.sqrt(np.sum(towards**2))
        second = level - towards * np.sum(towards * level)
        if np.sum(second**2) < 1e-6:
            for j in range(3):
                a, b = (j + 1) % 3, (j + 2) % 3
                second[j] = towards[a] * ANY[b] - towards[b] * ANY[a]
        second /= math.sqrt(np.sum(second**2))
        for j in range(3):
            a, b = (j + 1) % 3, (j + 2) % 3
            frames[k, j, 0] = second[a] * towards[b] - second[b] * towards[a]
            frames[k, j, 1], frames[k, j, 2] = second[j], towards[j]
    return frames


@kernel
def silhouette(vertices, planes, edges, lamp, turn):
    """Edges between what is turned to the lamp and what is not, in its frame, and a row of `Outlines.planes`.

    lamp, turn: where it is and its frame's axes, in the mesh's frame."""
    lit = np.empty(planes.shape[0], np.bool_)
    for f in range(planes.shape[0]):
        lit[f] = planes[f, 0] * lamp[0] + planes[f, 1] * lamp[1] + planes[f, 2] * lamp[2] > planes[f, 3]
    count = 0
    for e in range(edges.shape[0]):
        count += lit[edges[e, 2]] != lit[edges[e, 3]]
    result = np.empty((count, 2, 3), np.float32)
    moments, m = np.zeros((3, 4)), 0
    point = np.ones(4)
    for e in range(edges.shape[0]):
        if lit[edges[e, 2]] == lit[edges[e, 3]]:
            continue
        for end in range(2):
            v = edges[e, end if lit[edges[e, 2]] else 1 - end]
            for k in range(3):
                value = turn[0, k] * vertices[v, 0] + turn[1, k] * vertices[v, 1] + turn[2, k] * vertices[v, 2]
                result[m, end, k] = f32(value)
                point[k if k < 2 else 3] = value
            for k in range(3):
                for j in range(4):
                    moments[k, j] += point[k] * point[j]
        m += 1
    return result, _plane(moments)


@kernel
def _plane(moments):
    """Coefficients of depth = a x + b y + c: least squares by Cramer's rule."""
    plane = np.zeros(3)
    a, b, c = moments[0], moments[1], moments[2]
    volume = _volume(a[0] + 1e-12, a[1], a[2], b[0], b[1] + 1e-12, b[2], c[0], c[1], c[2] + 1e-12)
    plane[0] = _volume(a[3], a[1], a[2], b[3], b[1], b[2], c[3], c[1], c[2]) / volume
    plane[1] = _volume(a[0], a[3], a[2], b[0], b[3], b[2], c[0], c[3], c[2]) / volume
    plane[2] = _volume(a[0], a[1], a[3], b[0], b[1], b[3], c[0], c[1], c[3]) / volume
    return plane


@formula
def _volume(a0, a1, a2, b0, b1, b2, c0, c1, c2):
    return a0 * (b1 * c2 - b2 * c1) - a1 * (b0 * c2 - b2 * c0) + a2 * (b0 * c1 - b1 * c0)


@kernel
def choose_edges(near, outline, edges, lamp_radius, chosen):
    """Fill in `chosen` (int64, m) with the edges that matter to points `near`, as of `casters.around`: those beside or
    left of the lamp's disc; none where all are left of it, since the outline is closed. outline: as in `hide_behind`.
    Returns how many.
    """
    u, v, w, reach, du, dv, dw = near
    x, y, z = _into(outline, u, v, w)
    distance, blur, plane = outline[12], outline[16:18], outline[13:16]
    per_depth = ONE / (distance - z)
    count, left = 0, True
    room_x = extent(outline, 0, reach, du, dv, dw) * f32(1.05)
    room_y = extent(outline, 1, reach, du, dv, dw) * f32(1.05)
    depth = plane[0] * x + plane[1] * y + plane[2] - z - reach * (abs(plane[0]) + abs(plane[1]) + ONE)
    typical = lamp_radius * per_depth * max(depth, ZERO)
    stretch = max(ONE, (typical + blur[1] + TINY) / (typical + blur[0] + TINY))
    for m in range(edges.shape[0]):
        t0, t1 = (edges[m, 0, 2] - z) * per_depth, (edges[m, 1, 2] - z) * per_depth
        wide = lamp_radius * max(ZERO, t0, t1) + blur[0]
        tall = wide * stretch + blur[1]
        y0, y1 = edges[m, 0, 1] - y + y * t0, edges[m, 1, 1] - y + y * t1
        if min(y0, y1) > room_y + tall or max(y0, y1) < -room_y - tall:
            continue
        x0, x1 = edges[m, 0, 0] - x + x * t0, edges[m, 1, 0] - x + x * t1
        left = left and max(x0, x1) < -room_x - wide
        if min(x0, x1) > room_x + wide:
            continue
        chosen[count] = m
        count += 1
    return 0 if left else count


@formula
def held(x, half):
    """Integral of a coordinate that is held within +-half, from 0 to x."""
    size = abs(x)
    return HALF * size * size if size < half else half * size - HALF * half * half


@formula
def strip(x0, y0, slope, y1, low, high, half):
    """Signed area right of an edge, within one strip of the disc: low <= y <= high, |x| <= half."""
    start, end = min(max(y0, low), high), min(max(y1, low), high)
    first, last = x0 + (start - y0) * slope, x0 + (end - y0) * slope
    across = last - first
    middle = min(max(HALF * (first + last), -half), half)
    mean = (held(last, half) - held(first, half)) / across if abs(across) > STEEP else middle
    return (end - start) * (half - mean)


@kernel
def hide_behind(S, n, outline, edges, chosen, count, lamp_radius, layered):
    """HIDDEN = share of the lamp that an outline hides from the points U, V, W.

    outline (18,): turn (9) and move (3) from their frame to the lamp's, the lamp's distance, its plane (3), and half
    widths of a pixel's blur along the lamp's first and second axis, times the point's ROOM. edges: the outline's;
    chosen, count: of `choose_edges`. With `layered`, points nearer to the lamp than the plane are not in the shadow.
    """
    m00, m01, m02, m10, m11, m12 = outline[0], outline[1], outline[2], outline[3], outline[4], outline[5]
    m20, m21, m22, o0, o1, o2 = outline[6], outline[7], outline[8], outline[9], outline[10], outline[11]
    distance, p0, p1, p2 = outline[12], outline[13], outline[14], outline[15]
    blur_x, blur_y = outline[16] + TINY, outline[17] + TINY
    for i in range(n):
        u, v, w = S[U + i], S[V + i], S[W + i]
        x = o0 + m00 * u + m01 * v + m02 * w
        y = o1 + m10 * u + m11 * v + m12 * w
        z = o2 + m20 * u + m21 * v + m22 * w
        S[LAMP_X + i], S[LAMP_Y + i], S[LAMP_Z + i], S[HIDDEN + i] = x, y, z, ZERO
        per_depth = ONE / (distance - z)
        cone = lamp_radius * per_depth * max(p0 * x + p1 * y + p2 - z, ZERO)
        own = S[ROOM + i] * blur_x
        S[PER_DEPTH + i], S[BLUR + i], S[STRETCH + i] = per_depth, own, (cone + own) / (cone + S[ROOM + i] * blur_y)
    for k in range(count):
        m = chosen[k]
        ax, ay, az = edges[m, 0, 0], edges[m, 0, 1], edges[m, 0, 2]
        bx, by, bz = edges[m, 1, 0], edges[m, 1, 1], edges[m, 1, 2]
        for i in range(n):
            x, y, z = S[LAMP_X + i], S[LAMP_Y + i], S[LAMP_Z + i]
            ta, tb = (az - z) * S[PER_DEPTH + i], (bz - z) * S[PER_DEPTH + i]
            # Added, not as squares, and stretched by one number: a straight edge must stay straight before the disc.
            scale_a = ONE / (lamp_radius * max(ta, ZERO) + S[BLUR + i])
            scale_b = ONE / (lamp_radius * max(tb, ZERO) + S[BLUR + i])
            x0, y0 = (ax - x + x * ta) * scale_a, (ay - y + y * ta) * scale_a * S[STRETCH + i]
            x1, y1 = (bx - x + x * tb) * scale_b, (by - y + y * tb) * scale_b * S[STRETCH + i]
            rise = y1 - y0
            slope = (x1 - x0) / (rise + TINY if rise >= ZERO else rise - TINY)
            area = strip(x0, y0, slope, y1, -ONE, -HALF, OUTER) + strip(x0, y0, slope, y1, -HALF, ZERO, INNER)
            area += strip(x0, y0, slope, y1, ZERO, HALF, INNER) + strip(x0, y0, slope, y1, HALF, ONE, OUTER)
            S[HIDDEN + i] += area
    for i in range(n):
        hidden = min(abs(S[HIDDEN + i]) * PER_DISC, ONE)
        if layered:
            behind = (p0 * S[LAMP_X + i] + p1 * S[LAMP_Y + i] + p2 - S[LAMP_Z + i]) * f32(1 / DEPTH_M)
            hidden *= min(max(behind + HALF, ZERO), ONE)
        S[HIDDEN + i] = hidden


@kernel
def shade_behind(S, n, near, outline, edges, chosen, lamp_radius, layered):
    """`hide_behind` for points `near`, as of `casters.around`, with the edges that matter to them; chosen: scratch as
    long as `edges`. Returns whether any does; only then is HIDDEN set."""
    if layered and _in_front(near, outline):
        return False
    count = choose_edges(near, outline, edges, lamp_radius, chosen)
    if count > 0:
        hide_behind(S, n, outline, edges, chosen, count, lamp_radius, layered)
    return count > 0


@kernel
def _in_front(near, outline):
    """Whether all points are nearer to the lamp than an outline's plane."""
    u, v, w, reach = near[:4]
    x, y, z = _into(outline, u, v, w)
    room = reach * (abs(outline[13]) + abs(outline[14]) + ONE) + f32(DEPTH_M)
    return outline[13] * x + outline[14] * y + outline[15] - z < -room


@formula
def _into(outline, u, v, w):
    return (
        outline[0] * u + outline[1] * v + outline[2] * w + outline[9],
        outline[3] * u + outline[4] * v + outline[5] * w + outline[10],
        outline[6] * u + outline[7] * v + outline[8] * w + outline[11],
    )
