"""Share of a mesh that each pixel sees: its exact silhouette, and the triangles inside it.

Along the edges where the mesh turns away, signed areas add up to the coverage of every pixel, exactly where one layer
faces the camera. Inside, a pixel takes the nearest triangle at its middle. Pixels on a silhouette, or on an edge where
normals or texture break, take 16 samples and merge those of one smooth part.
"""

import math
from typing import NamedTuple

import numpy as np

from evslip.rendering.geometry.coverage import FULL, accumulate
from evslip.rendering.geometry.facets import Facets
from evslip.rendering.geometry.fragments import MOST, SAMPLES, gather_fragments, sample_place
from evslip.rendering.geometry.projection import DISTANCE, project, rows_of
from evslip.rendering.scratch import f32, formula, kernel


class Raster(NamedTuple):
    """Scratch memory and result of `trace`, for one resolution and one mesh."""

    points: np.ndarray
    """Vertices in camera axes, of shape (v, 3)."""
    image: np.ndarray
    """Vertices in pixels, x right, y down, of shape (v, 2)."""
    functions: np.ndarray
    """Numbers c (6, 3) of each face that the camera sees: c . (x, y, 1) at a place in pixels is 1 / depth for the
    first row, and texture coordinates and normal over depth for the others; of shape (f, 6, 3)."""
    facing: np.ndarray
    """Whether a face is turned to the camera, bool of shape (f,)."""
    area: np.ndarray
    spans: np.ndarray
    near: np.ndarray
    """1 / depth at the middle of each pixel, 0 where there is nothing; float32 of shape (height, width)."""
    owner: np.ndarray
    """Face at the middle of each pixel or -1, int32."""
    slot: np.ndarray
    """Number of a pixel that takes samples, or -1; int32."""
    slot_near: np.ndarray
    """1 / depth of each sample, of shape (slots, SAMPLES)."""
    slot_owner: np.ndarray
    """Face of each sample or -1."""
    edge_owner: np.ndarray
    """Face on the pixel's edge, and where that edge passes: the shape's rim may slip between all samples."""
    edge_place: np.ndarray
    fragment_pixel: np.ndarray
    """Flat index of each fragment's pixel; these arrays are longer than their content."""
    fragment_face: np.ndarray
    fragment_place: np.ndarray
    """In pixels, of shape (n, 2)."""
    fragment_share: np.ndarray


def make_raster(facets: Facets, width: int, height: int, shared: Raster | None = None) -> Raster:
    """shared: of another mesh at this resolution, which is never looked at once this one is traced."""
    slots = width * height  # every pixel may have one; what none uses takes no memory
    most = width * height + (MOST - 1) * slots
    of_mesh = {
        "points": np.zeros((len(facets.vertices), 3)),
        "image": np.zeros((len(facets.vertices), 2)),
        "functions": np.zeros((len(facets.faces), 6, 3)),
        "facing": np.zeros(len(facets.faces), np.bool_),
    }
    if shared is not None:
        return shared._replace(**of_mesh)
    return Raster(
        **of_mesh,
        area=np.zeros((height, width + 2)),
        spans=np.zeros((height, 2), np.int64),
        near=np.zeros((height, width), np.float32),
        owner=np.zeros((height, width), np.int32),
        slot=np.zeros((height, width), np.int32),
        slot_near=np.zeros((slots, SAMPLES), np.float32),
        slot_owner=np.zeros((slots, SAMPLES), np.int32),
        edge_owner=np.zeros(slots, np.int32),
        edge_place=np.zeros((slots, 2)),
        fragment_pixel=np.zeros(most, np.int32),
        fragment_face=np.zeros(most, np.int32),
        fragment_place=np.zeros((most, 2)),
        fragment_share=np.zeros(most, np.float32),
    )


@kernel
def trace(camera, turn, focal, place, axes, facets, raster, total, touched, full):
    """Find the fragments of a mesh; returns their number. place, axes: its pose; camera, turn: the camera's.

    total (height, width): coverage; touched and full (height, 2): the columns in which it is above 0, and the longest
    run in which it is 1.
    """
    height, width = total.shape
    project(camera, turn, focal, place, axes, facets, raster, width, height)
    low, high = rows_of(raster, width, height)
    # Rows that the mesh does not reach keep what an earlier frame left there; of these, `near` alone is looked at.
    first, last = max(0, low - 1), min(height, high + 1)
    raster.area[first:last] = 0.0
    for row in range(height):
        raster.spans[row, 0], raster.spans[row, 1] = width, 0
        touched[row, 0], touched[row, 1], full[row, 0], full[row, 1] = width, 0, 0, 0
        for column in range(width):
            total[row, column] = f32(0)
    raster.near[:] = f32(0)
    raster.owner[first:last] = -1
    raster.slot[first:last] = -1
    if high <= low:
        return 0
    slots = _follow_edges(facets, raster, low, high)
    _accumulate_rows(raster, total, touched, full, low, high)
    raster.slot_near[:slots] = f32(0)
    raster.slot_owner[:slots] = -1
    for face in range(facets.faces.shape[0]):
        if raster.facing[face]:
            _fill(face, facets.faces, raster)
    return gather_fragments(facets.patch, raster, total, touched)


@kernel
def _follow_edges(facets, raster, low, high):
    """Accumulate the silhouette's signed areas and give slots to the pixels on silhouettes and creases."""
    used = 0
    for e in range(facets.edges.shape[0]):
        first, second = facets.edges[e, 2], facets.edges[e, 3]
        ahead, behind = raster.facing[first], raster.facing[second]
        if not (ahead or behind) or (ahead and behind and not facets.crease[e]):
            continue
        i, j = facets.edges[e, 0], facets.edges[e, 1]
        xa, ya, xb, yb = raster.image[i, 0], raster.image[i, 1], raster.image[j, 0], raster.image[j, 1]
        if ahead and not behind:
            accumulate(xa, ya, xb, yb, raster.area, raster.spans, low, high)
        elif behind and not ahead:
            accumulate(xb, yb, xa, ya, raster.area, raster.spans, low, high)
        used = _give_slots(xa, ya, xb, yb, first if ahead else second, raster, used)
    return used


@kernel
def _give_slots(xa, ya, xb, yb, face, raster, used):
    height, width = raster.slot.shape
    if ya > yb:
        xa, ya, xb, yb = xb, yb, xa, ya
    slope = (xb - xa) / (yb - ya) if yb > ya else 0.0
    for row in range(max(0, math.floor(ya)), min(height, math.floor(yb) + 1)):
        y0, y1 = max(float(row), ya), min(row + 1.0, yb)
        x0, x1 = xa + (y0 - ya) * slope, xa + (y1 - ya) * slope
        if ya == yb:
            x0, x1 = xa, xb
        left, right = min(x0, x1), max(x0, x1)
        for column in range(max(0, math.floor(left)), min(width, math.floor(right) + 1)):
            if raster.slot[row, column] < 0 and used < raster.edge_owner.size:
                raster.slot[row, column] = used
                raster.edge_owner[used] = face
                share = 0.5 * (max(left, float(column)) + min(right, column + 1.0)) - left
                share = share / (right - left) if right > left else 0.5
                share = share if x1 >= x0 else 1 - share
                raster.edge_place[used, 0] = x0 + share * (x1 - x0)
                raster.edge_place[used, 1] = y0 + share * (y1 - y0)
                used += 1
    return used


@kernel
def _accumulate_rows(raster, total, touched, full, low, high):
    width = total.shape[1]
    for row in range(low, high):
        first, last = raster.spans[row, 0], min(raster.spans[row, 1], width)
        covered, run, best = 0.0, 0, 0
        for column in range(first, last):
            covered += raster.area[row, column]
            share = min(1.0, abs(covered))
            if share < 1e-7:
                run = 0
                continue
            touched[row, 0] = min(touched[row, 0], column)
            touched[row, 1] = column + 1
            run = run + 1 if share > FULL else 0
            total[row, column] = f32(share if share <= FULL else 1.0)
            if run > best:
                best = run
                full[row, 0], full[row, 1] = column + 1 - run, column + 1


@kernel
def _fill(face, faces, raster):
    """Depth-test the middles of the pixels, and the samples of those with a slot, inside a triangle."""
    image, near, owner, slot = raster.image, raster.near, raster.owner, raster.slot
    height, width = near.shape
    d = raster.functions[face, DISTANCE]
    ia, ib, ic = faces[face, 0], faces[face, 1], faces[face, 2]
    ax, ay, bx, by, cx, cy = image[ia, 0], image[ia, 1], image[ib, 0], image[ib, 1], image[ic, 0], image[ic, 1]
    d0, d1, d2 = d[0], d[1], d[2]
    top, bottom = min(ay, by, cy), max(ay, by, cy)
    sides = (_side(ax, ay, bx, by), _side(bx, by, cx, cy), _side(cx, cy, ax, ay))
    for row in range(max(0, math.floor(top)), min(height, math.floor(bottom) + 1)):
        # The triangle's reach in this row of pixels, and at the height of their middles.
        left, right, from_x, to_x = 1e9, -1e9, 1e9, -1e9
        for x0, y0, x1, y1, slope in sides:
            if y1 < row or y0 > row + 1:
                continue
            start = x0 + (row - y0) * slope if y0 < row else x0
            end = x0 + (row + 1 - y0) * slope if y1 > row + 1 else x1
            left, right = min(left, start, end), max(right, start, end)
            if y0 <= row + 0.5 < y1:
                x = x0 + (row + 0.5 - y0) * slope
                from_x, to_x = min(from_x, x), max(to_x, x)
        first, last = max(0, math.ceil(from_x - 0.5)), min(width, math.ceil(to_x - 0.5))
        for column in range(first, last):
            if slot[row, column] < 0:
                w = f32(d0 * (column + 0.5) + d1 * (row + 0.5) + d2)
                if w > near[row, column]:
                    near[row, column] = w
                    owner[row, column] = face
        for column in range(max(0, math.floor(left)), min(width, math.floor(right) + 1)):
            k = slot[row, column]
            if k < 0:
                continue
            for s in range(SAMPLES):
                across, down = sample_place(s)
                px, py = column + across, row + down
                ab = (bx - ax) * (py - ay) - (by - ay) * (px - ax)
                bc = (cx - bx) * (py - by) - (cy - by) * (px - bx)
                ca = (ax - cx) * (py - cy) - (ay - cy) * (px - cx)
                if ab <= 0 and bc <= 0 and ca <= 0:
                    w = f32(d0 * px + d1 * py + d2)
                    if w > raster.slot_near[k, s]:
                        raster.slot_near[k, s] = w
                        raster.slot_owner[k, s] = face


@formula
def _side(x0, y0, x1, y1):
    """An edge from its upper to its lower end, and its slope."""
    if y0 > y1:
        x0, y0, x1, y1 = x1, y1, x0, y0
    return x0, y0, x1, y1, (x1 - x0) / (y1 - y0) if y1 > y0 else 0.0
