"""The shadow of a mesh: the lamp's disc, cut by the mesh's outline as the lamp sees it.

A lamp is small seen from what it lights, so the edges that can hide part of it are those where the mesh turns away from
the lamp's centre. From a point in shadow, each such edge is a line in front of the lamp's disc; all of them close to
outlines, and the hidden share is the outlines' area on the disc: summed edge by edge in strips across the disc, as the
silhouettes of `coverage` are summed in the pixels of a row.
"""

import math
from typing import NamedTuple

import numpy as np

from evslip.rendering.facets import Facets
from evslip.rendering.lanes import (
    BLUR,
    HALF,
    HIDDEN,
    LAMP_X,
    LAMP_Y,
    LAMP_Z,
    ONE,
    PER_DEPTH,
    ROOM,
    SEEN_NOW,
    STRETCH,
    ZERO,
    U,
    V,
    W,
    f32,
    formula,
    kernel,
)  # fmt: skip

TINY = f32(1e-9)
STEEP = f32(0.02)
"""An edge that crosses less of a strip's width than this has its middle's value."""
PIXEL_BLUR = 0.5
"""Radius of the disc that stands for a pixel."""
INNER, OUTER = f32(0.9566115), f32(0.6141848)
"""Mean half chords of the unit disc over heights 0 to 1/2 and 1/2 to 1."""
PER_DISC = f32(1 / math.pi)
DEPTH_M = 0.004
"""Over this depth a receiver passes from the lit side of an outline to its shadow."""


class Outline(NamedTuple):
    """Edges of a mesh as its lamp sees them, in the lamp's frame: origin in the mesh, third axis towards the lamp."""

    turn: np.ndarray
    """The frame's axes in the world as columns, (3, 3)."""
    place: np.ndarray
    """Its origin in the world, (3,)."""
    edges: np.ndarray
    """Both ends of every edge, float32 of shape (m, 2, 3)."""
    distance: float
    """From the origin to the lamp's centre."""
    size: float
    """Radius of a sphere around the origin that holds the mesh."""
    plane: np.ndarray
    """(a, b, c): the outline lies about at depth a x + b y + c."""


def no_outline() -> Outline:
    return Outline(np.eye(3), np.zeros(3), np.zeros((0, 2, 3), np.float32), 1.0, 0.0, np.zeros(3))


def outline_of(
    facets: Facets, place: np.ndarray, axes: np.ndarray, lamp: np.ndarray, forward: np.ndarray, size: float
) -> Outline:
    """The outline of a mesh at a pose. forward (3,): direction of view; along its horizontal part pixels stretch
    on the surface."""
    towards = lamp - place
    distance = float(np.linalg.norm(towards))
    third = towards / distance
    level = forward * (1.0, 1.0, 0.0)
    second = level - third * (third @ level)
    if second @ second < 1e-6:
        second = np.cross(third, (0.3, 0.5, 0.81))
    second /= np.linalg.norm(second)
    turn = np.stack([np.cross(second, third), second, third], 1)
    edges, plane = _silhouette(facets.vertices, facets.planes, facets.edges, axes.T @ towards, axes.T @ turn)
    return Outline(turn, place, edges, distance, size, plane)


@kernel
def _silhouette(vertices, planes, edges, lamp, turn):
    """Edges between what is turned to the lamp and what is not, in its frame, and `Outline.plane`. lamp, turn: where it
    is and its frame's axes, in the mesh's frame."""
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
    """Least squares by Cramer's rule: of depth = a x + b y + c."""
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
def choose_edges(u, v, w, reach, turn, move, edges, distance, lamp_radius, blur, plane, chosen):
    """Fill in `chosen` (int64, m) with the edges that matter to points within `reach` of (u, v, w): those beside or
    left of the lamp's disc. turn, move: the points' frame -> the lamp's. blur, plane: as in `hide_behind`. Returns how
    many.
    """
    x = turn[0, 0] * u + turn[0, 1] * v + turn[0, 2] * w + move[0]
    y = turn[1, 0] * u + turn[1, 1] * v + turn[1, 2] * w + move[1]
    z = turn[2, 0] * u + turn[2, 1] * v + turn[2, 2] * w + move[2]
    per_depth = ONE / (distance - z)
    count = 0
    room = reach * f32(1.05)
    depth = plane[0] * x + plane[1] * y + plane[2] - z - reach * (abs(plane[0]) + abs(plane[1]) + ONE)
    typical = lamp_radius * per_depth * max(depth, ZERO)
    stretch = max(ONE, (typical + blur[1] + TINY) / (typical + blur[0] + TINY))
    for m in range(edges.shape[0]):
        t0, t1 = (edges[m, 0, 2] - z) * per_depth, (edges[m, 1, 2] - z) * per_depth
        wide = lamp_radius * max(ZERO, t0, t1) + blur[0]
        tall = wide * stretch + blur[1]
        y0, y1 = edges[m, 0, 1] - y + y * t0, edges[m, 1, 1] - y + y * t1
        if min(y0, y1) > room + tall or max(y0, y1) < -room - tall:
            continue
        if min(edges[m, 0, 0] - x + x * t0, edges[m, 1, 0] - x + x * t1) > room + wide:
            continue
        chosen[count] = m
        count += 1
    return count


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
def hide_behind(S, n, turn, move, edges, chosen, count, distance, lamp_radius, blur, plane, layered):
    """SEEN_NOW *= share of the lamp that an outline leaves visible from the points U, V, W.

    turn, move: their frame -> the lamp's; chosen, count: of `choose_edges`; blur (2,): half width of a pixel's blur
    along the lamp's first and second axis, times the point's ROOM. With `layered`, points nearer to the lamp than
    `plane` are not in the shadow.
    """
    m00, m01, m02 = turn[0, 0], turn[0, 1], turn[0, 2]
    m10, m11, m12 = turn[1, 0], turn[1, 1], turn[1, 2]
    m20, m21, m22 = turn[2, 0], turn[2, 1], turn[2, 2]
    o0, o1, o2 = move[0], move[1], move[2]
    blur_x, blur_y = blur[0] + TINY, blur[1] + TINY
    p0, p1, p2 = plane[0], plane[1], plane[2]
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
        S[SEEN_NOW + i] *= ONE - hidden


@kernel
def outline_scratch(outline):
    """Room for `choose_edges`."""
    return np.empty(outline.edges.shape[0], np.int64)


@kernel
def shade_behind(S, n, middle, reach, turn, move, outline, chosen, lamp_radius, blur, layered):
    """`hide_behind` for points within `reach` of `middle` (3,), with the edges that matter to them."""
    edges, distance = outline.edges, f32(outline.distance)
    u, v, w = f32(middle[0]), f32(middle[1]), f32(middle[2])
    plane = outline.plane.astype(np.float32)
    if layered and _in_front(u, v, w, f32(reach), turn, move, plane):
        return
    count = choose_edges(u, v, w, f32(reach), turn, move, edges, distance, lamp_radius, blur, plane, chosen)
    if count > 0:
        hide_behind(S, n, turn, move, edges, chosen, count, distance, lamp_radius, blur, plane, layered)


@kernel
def _in_front(u, v, w, reach, turn, move, plane):
    """Whether all points within `reach` of (u, v, w) are nearer to the lamp than an outline's plane."""
    x = turn[0, 0] * u + turn[0, 1] * v + turn[0, 2] * w + move[0]
    y = turn[1, 0] * u + turn[1, 1] * v + turn[1, 2] * w + move[1]
    z = turn[2, 0] * u + turn[2, 1] * v + turn[2, 2] * w + move[2]
    room = reach * (abs(plane[0]) + abs(plane[1]) + ONE) + f32(DEPTH_M)
    return plane[0] * x + plane[1] * y + plane[2] - z < -room
