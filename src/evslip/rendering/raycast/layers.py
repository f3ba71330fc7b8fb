"""The gripper's image, resolved once per finger opening into a few fragments per pixel.

Hand and fingers do not move in the image unless the camera trembles, so their visibility is found once, see
`geometry.supersampling`. Each frame only shades the fragments again. What a camera sees that is displaced a little is
made of the fragments that it sees where it belongs, see `geometry.displacement`.
"""

from typing import NamedTuple

import numpy as np

from evslip.rendering.camera import Camera
from evslip.rendering.geometry.clipping import clip_near
from evslip.rendering.geometry.displacement import MARGIN, Displaceable, displace, prepare_displacement
from evslip.rendering.geometry.hand import assemble
from evslip.rendering.geometry.supersampling import (
    BLUE,
    GRID,
    LUMA,
    NEAR_M,
    RED,
    SHARE,
    Triangles,
    rasterise,
    turned_here,
)
from evslip.rendering.scratch import BLOCK, kernel

LUMA_WEIGHTS = np.array([0.2126, 0.7152, 0.0722])
"""Weights of linear RGB (ITU-R BT.709)."""


class Layers(NamedTuple):
    fragments: np.ndarray
    """float32 of shape (ROWS, n), in the order of the pixels; see the row names of `geometry.supersampling`. BODY:
    HAND, LEFT or RIGHT of `hand`."""
    pixels: np.ndarray
    """Flat index of every pixel that has fragments, of shape (m,)."""
    starts: np.ndarray
    """First fragment of each of these pixels, then n; of shape (m + 1,)."""
    seen: np.ndarray
    """Runs of columns in each row that the gripper does not cover wholly: first and past the last, of shape (height, k,
    2); the width, twice, after a row's last one. Gaps shorter than a BLOCK are left out."""


def resolve(camera: Camera, travel_m: float) -> Layers:
    """The gripper as `camera` sees it with both fingers `travel_m` from the middle."""
    fragments, where, _ = _supersampled(camera, travel_m)
    pixels, starts = np.unique(where, return_index=True)
    covered = np.bincount(where, fragments[SHARE], camera.width * camera.height)
    runs = runs_between((covered > 1 - 1e-6).reshape(camera.height, camera.width))
    return Layers(fragments, pixels, np.append(starts, len(where)), runs)


def displaceable(camera: Camera, travel_m: float) -> Displaceable:
    """The gripper as cameras that are displaced a little from `camera` see it."""
    wide = camera._replace(width=camera.width + 2 * MARGIN, height=camera.height + 2 * MARGIN)
    return prepare_displacement(*_supersampled(wide, travel_m), wide)


def displaced(seen: Displaceable, camera: Camera) -> Layers:
    """The gripper as `camera` sees it, which is displaced a little. Nothing behind it is taken for hidden: how much is,
    changes from frame to frame."""
    fragments, where = displace(seen, camera)
    pixels, starts = np.unique(where, return_index=True)
    everything = np.broadcast_to(np.array([0, camera.width]), (camera.height, 1, 2)).copy()
    return Layers(fragments, pixels, np.append(starts, len(where)), everything)


def _supersampled(camera: Camera, travel_m: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """As `supersampling.rasterise`, with LUMA."""
    mesh, parts = clip_near(*assemble(travel_m, camera.fingers, camera.gripper), camera, NEAR_M)
    size = camera.width, camera.height, camera.focal_px
    seen = turned_here(mesh.corners, camera.position, camera.rotation, size)
    image = camera.project((mesh.corners[seen] - camera.position) @ camera.rotation)
    normals = mesh.normals[seen] @ camera.rotation
    triangles = Triangles(image * (GRID, GRID, 1.0), normals, mesh.albedo[seen], parts[seen])
    fragments, where, samples = rasterise(triangles, size)
    fragments[LUMA] = LUMA_WEIGHTS.astype(np.float32) @ fragments[RED : BLUE + 1]
    return fragments, where, samples


@kernel
def runs_between(hidden):
    """`Layers.seen` of a mask (height, width)."""
    height, width = hidden.shape
    runs, most = np.full((height, width // BLOCK + 1, 2), width), 0
    for row in range(height):
        count, last = 0, -BLOCK - 1
        for column in range(width):
            if hidden[row, column]:
                continue
            if column - last > BLOCK:
                runs[row, count, 0] = column
                count += 1
            last = column
            runs[row, count - 1, 1] = column + 1
        most = max(most, count)
    return runs[:, : max(most, 1)].copy()
