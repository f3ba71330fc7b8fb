"""Meshes of the gripper and of links."""

import numpy as np
import pytest
import trimesh

from evslip.rendering.geometry.hand import read_mesh


@pytest.mark.parametrize("sides", [(1.0, 1.0, 1.0), (-1.0, 1.0, 1.0), (0.5, 0.5, 0.5), (2.0, 0.3, -1.0)])
def test_a_mesh_that_its_file_stretches_or_mirrors_is_right_side_out(sides, tmp_path):
    place = np.array(trimesh.transformations.rotation_matrix(0.7, (0.3, -0.5, 0.8), (0.1, 0.2, 0.3)))
    place[:3, :3] = place[:3, :3] @ np.diag(sides)
    scene = trimesh.Scene()
    scene.add_geometry(trimesh.creation.icosphere(3, 0.05), transform=place)
    scene.export(tmp_path / "look.glb")
    corners, normals, _ = read_mesh(tmp_path / "look.glb")
    a, b, c = corners.transpose(1, 0, 2)
    assert np.sum(a * np.cross(b, c)) / 6 == pytest.approx(4 / 3 * np.pi * 0.05**3 * abs(np.prod(sides)), rel=0.02)
    across = np.cross(b - a, c - a)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    assert np.linalg.norm(normals, axis=2) == pytest.approx(np.ones(normals.shape[:2]), abs=1e-6)
    along = np.sum(across[:, None] * normals, axis=2)
    assert along.min() > 0.7 and along.mean() > 0.99
