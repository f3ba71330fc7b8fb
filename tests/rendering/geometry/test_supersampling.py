import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.rendering.camera import hand_camera
from evslip.rendering.geometry.hand import assemble
from evslip.rendering.geometry.supersampling import GRID, MOST, NEAR_M, NONE, SHARE, Triangles, rasterise, turned_here


@pytest.mark.parametrize("mount", ["side", "front"])
def test_no_triangle_in_view_is_left_out(mount):
    camera = hand_camera(draw(load_config("simple", {"camera.mount": mount}), 0), (173, 130))
    mesh, _ = assemble(0.02)
    for seed in range(20):
        turn = Rotation.random(random_state=seed) if seed % 2 else Rotation.identity()
        place = camera._replace(rotation=turn.as_matrix() @ camera.rotation)
        corners = (mesh.corners - place.position) @ place.rotation
        ahead = np.all(corners[..., 2] < -NEAR_M, 1)
        x, y, _ = np.moveaxis(place.project(np.where(ahead[:, None, None], corners, -1.0)), -1, 0)
        area = (x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (y[:, 1] - y[:, 0]) * (x[:, 2] - x[:, 0])
        reaches = (x.max(1) > 0) & (x.min(1) < place.width) & (y.max(1) > 0) & (y.min(1) < place.height)
        found = turned_here(mesh.corners, place.position, place.rotation, (place.width, place.height, place.focal_px))
        assert np.all(np.diff(found) > 0) and ahead[found].all()
        assert set(np.flatnonzero(ahead & reaches & (area < 0))) <= set(found)


def test_samples_say_which_fragment_they_show():
    square = np.array([[[8.0, 8.0, 1.0], [8.0, 24.0, 1.0], [24.0, 8.0, 1.0]]])
    normals, white = np.tile([0.0, 0.0, 1.0], (1, 3, 1)), np.full((1, 3), 0.5)
    fragments, where, samples = rasterise(Triangles(square, normals, white, np.zeros(1, np.uint8)), (4, 4, 10.0))
    assert where.tolist() == [5, 6, 9] and samples.shape == (3, GRID * GRID)
    shown = (samples != NONE).mean(1)
    assert shown == pytest.approx(fragments[SHARE]) and shown[0] == 1
    assert np.all(samples[samples != NONE] < MOST)
    corner = samples[1].reshape(GRID, GRID) != NONE
    assert corner[0, 0] and not corner[-1, -1]
