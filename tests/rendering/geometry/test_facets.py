"""Meshes made ready for drawing."""

from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from evslip.rendering.geometry.facets import prepare_facets
from evslip.rendering.geometry.raster import make_raster, trace
from evslip.scene.shapes.surface import box_uv, corner_normals

SIZE = 64, 48


def facets_of(*bodies):
    """Facets of bodies that are one mesh."""
    whole: Any = trimesh.util.concatenate(bodies)
    whole.merge_vertices()
    vertices, faces = np.asarray(whole.vertices), np.asarray(whole.faces)
    return prepare_facets(vertices, faces, box_uv(vertices, faces), corner_normals(vertices, faces))


def box_at(*place):
    return trimesh.creation.box((0.02, 0.02, 0.02), trimesh.transformations.translation_matrix(place))


@pytest.fixture(scope="module")
def touching():
    """Two boxes that have an edge in common: four faces meet there."""
    return facets_of(box_at(0.01, 0.01, 0.0), box_at(-0.01, -0.01, 0.0))


def coverage(facets, turn):
    width, height = SIZE
    total, spans = np.zeros((height, width), np.float32), np.zeros((2, height, 2), np.int64)
    raster = make_raster(facets, width, height)
    trace(np.array([0.0, 0.0, 0.15]), np.eye(3), 100.0, np.zeros(3), turn, facets, raster, total, *spans)
    return total


def test_an_edge_runs_forth_in_one_face_and_back_in_the_other(touching):
    tails, heads = touching.faces, np.roll(touching.faces, -1, 1)
    for tail, head, first, second in touching.edges:
        assert ((tails[first] == tail) & (heads[first] == head)).any()
        assert ((tails[second] == head) & (heads[second] == tail)).any()
    assert len(touching.edges) == 36 and len(touching.vertices) == 14


@pytest.mark.parametrize("seed", range(6))
def test_bodies_that_touch_along_an_edge_cover_what_each_does(touching, seed):
    turn = Rotation.from_rotvec(2.0 * np.random.default_rng(seed).standard_normal(3)).as_matrix()
    alone = [coverage(facets_of(box_at(*place)), turn) for place in ((0.01, 0.01, 0.0), (-0.01, -0.01, 0.0))]
    found = coverage(touching, turn)
    assert found == pytest.approx(np.maximum(*alone), abs=0.6)  # where silhouettes cross, pixels have some of both
    apart = np.minimum(*alone) == 0
    assert found[apart] == pytest.approx(np.maximum(*alone)[apart], abs=1e-6)
