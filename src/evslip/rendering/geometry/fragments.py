"""Fragments of a mesh in each pixel: one, or on silhouettes and creases a few that samples are merged into."""

import numpy as np

from evslip.rendering.geometry.projection import DISTANCE
from evslip.rendering.scratch import f32, formula, kernel

SAMPLES = 16
STEP = 3
"""Step of the lattice of samples (k, STEP k mod SAMPLES): no two share a row or a column, neighbours are far apart."""
MOST = 4
"""Fragments in a pixel."""
SAME_DEPTH = 0.05
"""Relative difference of distances within one fragment."""


@formula
def sample_place(s):
    """Place of a sample in its pixel, to the right and down."""
    return (s + 0.5) / SAMPLES, ((s * STEP) % SAMPLES + 0.5) / SAMPLES


@kernel
def gather_fragments(patch, raster, total, touched):
    """List the fragments row by row, leave the depth of each pixel in `near`, and return how many they are."""
    height, width = total.shape
    count, face = 0, -1
    cluster = np.empty((MOST, 4))
    members = np.empty(MOST, np.int64)
    for row in range(height):
        for column in range(touched[row, 0], touched[row, 1]):
            if total[row, column] <= f32(0):
                continue
            k = raster.slot[row, column]
            if k < 0:
                face = raster.owner[row, column]
                if face < 0:
                    total[row, column] = f32(0)  # a hole that rounding has made
                    continue
                _put(raster, count, row * width + column, face, column + 0.5, row + 0.5, total[row, column])
                count += 1
                continue
            used = _merge(k, patch, raster, cluster, members)
            if used == 0:
                own, x, y = raster.edge_owner[k], raster.edge_place[k, 0], raster.edge_place[k, 1]
                raster.near[row, column] = f32(_inverse_depth(raster, own, x, y))
                _put(raster, count, row * width + column, own, x, y, total[row, column])
                count += 1
                continue
            hits = 0.0
            for m in range(used):
                hits += cluster[m, 0]
                raster.near[row, column] = max(raster.near[row, column], f32(cluster[m, 3] / cluster[m, 0]))
            for m in range(used):
                x, y = column + cluster[m, 1] / cluster[m, 0], row + cluster[m, 2] / cluster[m, 0]
                s = members[m]
                face = raster.slot_owner[k, s]
                # The cluster's middle may lie beyond the sample's own triangle, but not off its plane's near side.
                if abs(_inverse_depth(raster, face, x, y) / raster.slot_near[k, s] - 1) > SAME_DEPTH:
                    across, down = sample_place(s)
                    x, y = column + across, row + down
                _put(raster, count, row * width + column, face, x, y, total[row, column] * f32(cluster[m, 0] / hits))
                count += 1
    return count


@kernel
def _inverse_depth(raster, face, x, y):
    d = raster.functions[face, DISTANCE]
    return d[0] * x + d[1] * y + d[2]


@kernel
def _put(raster, at, pixel, face, x, y, share):
    raster.fragment_pixel[at], raster.fragment_face[at] = pixel, face
    raster.fragment_place[at, 0], raster.fragment_place[at, 1] = x, y
    raster.fragment_share[at] = share


@kernel
def _merge(k, patch, raster, cluster, members):
    """Gather a pixel's samples by smooth part and depth: count, sums of x, y and 1 / depth, and one sample of each that
    lies near the middle. Returns how many clusters."""
    used = 0
    for s in range(SAMPLES):
        face = raster.slot_owner[k, s]
        if face < 0:
            continue
        near = raster.slot_near[k, s]
        place = -1
        for m in range(used):
            other = raster.slot_owner[k, members[m]]
            alike = abs(near * cluster[m, 0] / cluster[m, 3] - 1) < SAME_DEPTH
            if patch[other] == patch[face] and alike:
                place = m
        if place < 0 and used < MOST:
            place = used
            used += 1
            members[place] = s
            cluster[place] = 0.0
        place = max(place, 0)
        cluster[place, 0] += 1.0
        across, down = sample_place(s)
        cluster[place, 1] += across
        cluster[place, 2] += down
        cluster[place, 3] += near
    for m in range(used):
        best = 4.0
        x, y = cluster[m, 1] / cluster[m, 0], cluster[m, 2] / cluster[m, 0]
        chosen = patch[raster.slot_owner[k, members[m]]]
        for s in range(SAMPLES):
            if raster.slot_owner[k, s] >= 0 and patch[raster.slot_owner[k, s]] == chosen:
                alike = abs(raster.slot_near[k, s] * cluster[m, 0] / cluster[m, 3] - 1) < SAME_DEPTH
                across, down = sample_place(s)
                off = (across - x) ** 2 + (down - y) ** 2
                if alike and off < best:
                    best = off
                    members[m] = s
    return used
