"""Triangles that reach from before a camera to beside or behind it, cut at a plane in front of it."""

import numpy as np

from evslip.rendering.camera import Camera
from evslip.rendering.geometry.hand import Mesh

MARGIN = 1 + 1e-6
"""Cut triangles begin by this factor beyond the plane: rounding shall put none of their corners before it."""


def clip_near(mesh: Mesh, parts: np.ndarray, camera: Camera, near_m: float) -> tuple[Mesh, np.ndarray]:
    """A mesh in the camera's mounting frame, and the part of each triangle, (n,), without what lies nearer than a plane
    at this distance along the camera's axis; all the same where no triangle is cut by it."""
    depth = (camera.position - mesh.corners) @ camera.rotation[:, 2]
    ahead = depth > near_m
    count = ahead.sum(1)
    cut = (count > 0) & (count < 3)
    if not cut.any():
        return mesh, parts
    pieces, owners = [], []
    for face in np.flatnonzero(cut):
        values = np.concatenate([mesh.corners[face], mesh.normals[face]], axis=1)
        ring = []
        for here in range(3):
            after = (here + 1) % 3
            if ahead[face, here]:
                ring.append(values[here])
            if ahead[face, here] != ahead[face, after]:
                a, b = depth[face, here], depth[face, after]
                ring.append(values[here] + (MARGIN * near_m - a) / (b - a) * (values[after] - values[here]))
        pieces += [[ring[0], ring[k], ring[k + 1]] for k in range(1, len(ring) - 1)]
        owners += [face] * (len(ring) - 2)
    made, whole = np.array(pieces), ~cut
    clipped = Mesh(
        np.concatenate([mesh.corners[whole], made[..., :3]]),
        np.concatenate([mesh.normals[whole], made[..., 3:]]),
        np.concatenate([mesh.albedo[whole], mesh.albedo[owners]]),
    )
    return clipped, np.concatenate([parts[whole], parts[owners]])
