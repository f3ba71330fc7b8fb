import numpy as np
import pytest

from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.rendering.camera import hand_camera
from evslip.rendering.geometry.hand import (
    LEFT,
    RIGHT,
    assemble,
    block_parts,
    blocking_boxes,
    box_parts,
    shadow_boxes,
)
from evslip.rendering.geometry.supersampling import BODY, LUMA, NORMAL_X, SHARE, X, Z
from evslip.rendering.outputs import PixelRays
from evslip.rendering.poses import ScenePoses
from evslip.rendering.raycast.layers import resolve
from evslip.rendering.raycast.openings import Openings
from evslip.rendering.scratch import BLOCK
from made_up import still


@pytest.fixture(scope="module")
def camera():
    return hand_camera(draw(load_config("simple"), 0), (173, 130))


@pytest.fixture(scope="module")
def layers(camera):
    return resolve(camera, 0.025)


def test_shares_fill_pixels_and_never_overfill(layers, camera):
    sums = np.add.reduceat(layers.fragments[SHARE].astype(float), layers.starts[:-1])
    assert sums.max() <= 1 + 1e-6 and sums.min() > 0
    assert np.all(np.diff(layers.pixels) > 0) and layers.pixels[-1] < camera.width * camera.height


def test_runs_of_columns_leave_out_what_the_gripper_covers(layers, camera):
    hidden = np.zeros((camera.height, camera.width), bool)
    sums = np.add.reduceat(layers.fragments[SHARE].astype(float), layers.starts[:-1])
    hidden.ravel()[layers.pixels[sums > 1 - 1e-6]] = True
    assert 0.03 < hidden.mean() < 0.3
    for row, runs in zip(hidden, layers.seen, strict=True):
        runs = runs[runs[:, 0] < camera.width]
        inside = np.zeros(camera.width, int)
        for first, past in runs:
            inside[first:past] += 1
            assert not row[first] and not row[past - 1]
        assert inside.max(initial=0) <= 1 and np.all(inside[~row] == 1)
        gaps = np.flatnonzero(np.diff(np.concatenate([[0], row, [0]]).astype(int)) == -1) - np.flatnonzero(
            np.diff(np.concatenate([[0], row, [0]]).astype(int)) == 1
        )
        assert np.sum(gaps >= BLOCK) == np.sum(np.diff(np.concatenate([[0], inside == 0, [0]]).astype(int)) == 1)


def test_fragments_lie_on_the_rays_of_their_pixels(layers, camera):
    pixels = np.repeat(layers.pixels, np.diff(layers.starts))
    image = camera.project(layers.fragments[X : Z + 1].T.astype(float))
    assert np.abs(image[:, 0] - pixels % camera.width - 0.5).max() < 0.51
    assert np.abs(image[:, 1] - pixels // camera.width - 0.5).max() < 0.51
    normals = layers.fragments[NORMAL_X : NORMAL_X + 3]
    assert np.linalg.norm(normals, axis=0) == pytest.approx(1, abs=1e-5)
    facing = -np.sum(normals * layers.fragments[X : Z + 1], 0)
    assert np.mean(facing > 0) > 0.98


def test_fingers_hang_from_above_and_the_near_one_hides_the_far_one(layers, camera):
    finger = layers.fragments[BODY] > 0
    rows = (np.repeat(layers.pixels, np.diff(layers.starts)) // camera.width)[finger]
    depth = -layers.fragments[Z][finger]
    assert rows.min() < 0.1 * camera.height and 0.3 * camera.height < rows.max() < 0.5 * camera.height
    assert np.mean(depth < 0.27) > 0.7
    assert 0.02 < layers.fragments[LUMA].min() < 0.1 and layers.fragments[LUMA].max() > 0.6


@pytest.mark.parametrize("travel_m", [0.0, 0.02, 0.04])
def test_shadow_boxes_lie_within_the_meshes_bounds(travel_m):
    mesh, parts = assemble(travel_m)
    boxes = shadow_boxes(travel_m)
    for part, own in ((0, [0]), (LEFT, [2, 3, 4]), (RIGHT, [5, 6, 7])):
        low, high = mesh.corners[parts == part].min((0, 1)), mesh.corners[parts == part].max((0, 1))
        for k in own:
            reach = np.abs(boxes.turns[k]) @ boxes.halves[k]
            assert np.all(boxes.places[k] - reach > low - 0.0015) and np.all(boxes.places[k] + reach < high + 0.0015)


@pytest.mark.parametrize("fingers", [(LEFT, RIGHT), (RIGHT,)])
def test_every_box_of_the_gripper_has_its_part(fingers):
    mesh, parts = assemble(0.02, fingers)
    assert set(parts) == {0, *fingers}
    for boxes, owners in (
        (shadow_boxes(0.02, fingers), box_parts(fingers)),
        (blocking_boxes(0.02, fingers), block_parts(fingers)),
    ):
        assert len(boxes.places) == len(owners)
        for part, place in zip(owners, boxes.places, strict=True):
            corners = mesh.corners[parts == part]
            assert part == 0 or np.all((corners.min((0, 1)) < place) & (place < corners.max((0, 1))))


def test_a_camera_beside_the_palm_sees_what_rays_through_its_pixels_meet():
    """Triangles of the palm reach from before this camera to behind it."""
    params = draw(load_config("simple", {"camera.mount": "finger", "camera.width": 173, "camera.height": 130}), 0)
    traj, camera = still(params), hand_camera(params)
    found = resolve(camera, float(traj.joints[0, 7:9].mean()))
    share = np.zeros(camera.width * camera.height)
    np.add.at(share, np.repeat(found.pixels, np.diff(found.starts)), found.fragments[SHARE])
    poses = ScenePoses(traj, camera, traj.t_us[:1])
    _, _, part = PixelRays(params, camera)._gripper(poses, 0)
    seen = part.ravel() <= RIGHT
    assert set(np.unique(part[part <= RIGHT])) == {0, RIGHT} == set(np.unique(found.fragments[BODY]))
    sure = (share < 0.05) | (share > 0.95)
    assert sure.mean() > 0.95 and np.mean((share > 0.5)[sure] == seen[sure]) > 0.999


def test_an_opening_depends_on_its_rounded_travel_alone(camera):
    openings = Openings(camera, 0.025)
    held = openings.at(0.025)
    assert openings.at(0.02504) is held
    assert openings.at(0.02512) is not held
    assert openings.at(0.02496) is held
    again = Openings(camera, 0.025)
    again.at(0.010)
    assert np.array_equal(again.at(0.02503).layers.fragments, held.layers.fragments)


def test_a_displaced_opening_depends_on_the_displacement_alone(camera):
    shifts = [[2e-4, 0.0, 1e-4], [0.02, 0.0, 0.0], [0.0, 3e-4, -2e-4]]
    used = Openings(camera, 0.025)
    for shift in shifts:
        there = camera._replace(position=camera.position + shift)
        found, alone = used.about(0.025, there), Openings(camera, 0.025).about(0.025, there)
        assert np.array_equal(found.layers.fragments, alone.layers.fragments)
        assert used.about(0.025, there) is found
