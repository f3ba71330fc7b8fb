from functools import partial
from typing import NamedTuple

import numpy as np
import pytest
import trimesh
from hypothesis import example, given, settings
from hypothesis import strategies as st

from brute_force import compare, cylinder, seen_share, triangles
from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.events.frame import BACKGROUND, OBJECT, SURFACE
from evslip.rendering.camera import hand_camera
from evslip.rendering.geometry.facets import prepare_facets
from evslip.rendering.poses import ScenePoses
from evslip.rendering.raycast import body
from evslip.rendering.raycast.mesh import Mesh, repetition_ratio
from evslip.rendering.raycast.renderer import Raycaster
from evslip.rendering.shadows.mesh_shadow import Solid, hide_behind, outlines_of, shade_behind
from evslip.rendering.slots import HIDDEN, ROOM, SCRATCH, SLOT, U, V, W
from evslip.scene.shapes import surface_of
from made_up import still, turning

SOFT = {"object__texture": "gradient-0", "surface__texture": "gradient-2", "background__texture": "gradient-3"}


def sample(**overrides):
    changes = {key.replace("__", "."): value for key, value in {**SOFT, **overrides}.items()}
    return draw(load_config("simple", {"camera.width": 138, "camera.height": 104, **changes}), 0)


@pytest.fixture(scope="module")
def ring(tmp_path_factory):
    """A ring that stands upright on a flat base: parts of it hide others, and the background shows through."""
    path = tmp_path_factory.mktemp("mesh") / "ring.stl"
    ring = trimesh.creation.torus(0.03, 0.012, major_sections=24, minor_sections=12)
    ring.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))
    ring.vertices[:, 2] = np.maximum(ring.vertices[:, 2], -0.035)
    ring.export(path)
    return {"object__shape": "mesh", "object__mesh": str(path), "object__mesh_fit": "own"}


def on_the_table(params):
    traj = still(params)
    traj.gripper_pose[:, 2] = params.object.height_m + 0.1034 - 0.01
    traj.object_pose[:, 2] = params.object.height_m / 2
    return traj


class Outline(NamedTuple):
    """One of `Outlines`, and the lamp that it is seen from."""

    edges: np.ndarray
    starts: np.ndarray
    frames: np.ndarray
    origins: np.ndarray
    planes: np.ndarray
    lamp: np.ndarray


def outline_of(facets, place, axes, lamp, forward):
    solid, level = Solid(facets.vertices, facets.planes, facets.edges), forward * (1, 1, 0)
    return Outline(*outlines_of([solid], np.array([place], float), axes[None], lamp, level), lamp)


def seen(points, outline, lamp_radius, blur=(1e-6, 1e-6), all_edges=False):
    """Shares of the lamp that an outline leaves visible from points in the world. With `all_edges` in double precision:
    what those beside the lamp's disc hide adds up to 0, in single precision only within 2e-4."""
    kind = np.float64 if all_edges else np.float32
    S, result = np.zeros(SCRATCH, kind), []
    frame, origin, lamp = outline.frames[0], outline.origins[0], outline.lamp
    away = np.linalg.norm(lamp - origin)
    row = np.array([*frame.T.ravel(), *-frame.T @ origin, away, *outline.planes[0], *blur], kind)
    chosen = np.empty(len(outline.edges), np.int64)
    for start in range(0, len(points), SLOT):
        chunk = points[start : start + SLOT].astype(np.float32)
        n = len(chunk)
        for slot, values in zip((U, V, W), chunk.T, strict=True):
            S[slot : slot + n] = values
        S[ROOM : ROOM + n], S[HIDDEN : HIDDEN + n] = 1, 0
        middle = (chunk.min(0) + chunk.max(0)) / 2
        near = (*middle, np.linalg.norm(chunk - middle, axis=1).max(), *np.ptp(chunk, axis=0) / 2)
        if all_edges:
            edges = outline.edges.astype(kind)
            hide_behind(S, n, row, edges, np.arange(len(chosen)), len(chosen), kind(lamp_radius), False)
        else:
            shade_behind(S, n, near, row, outline.edges, chosen, kind(lamp_radius), False)
        result.append(1 - S[HIDDEN : HIDDEN + n])
    return np.concatenate(result)


@given(st.integers(0, 10**6))
@example(2806)
@settings(max_examples=40)
def test_edges_that_are_left_out_hide_nothing(seed):
    rng = np.random.default_rng(seed)
    facets = prepare_facets(*surface_of(sample(object__shape="cylinder")))
    lamp, place, radius = np.array([4.0, -3.0, 8.0]) * 3, np.array([0.0, 0.0, 0.1]), rng.uniform(0.1, 2.0)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    axes[:, 2] *= np.linalg.det(axes)
    outline = outline_of(facets, place, axes, lamp, np.array([0.0, 1.0, 0.0]))
    middle, along = np.append(rng.uniform(-0.2, 0.2, 2), 0.0), np.append(rng.normal(size=2), 0.0)
    points = middle + np.linspace(-0.5, 0.5, SLOT)[:, None] * along * rng.uniform(0.01, 0.1)
    chosen, every = (seen(points, outline, radius, (1e-3, 2e-3), all_edges) for all_edges in (False, True))
    np.testing.assert_allclose(chosen, every, atol=1e-4)


@pytest.mark.parametrize(("polar", "lamp_radius"), [(55.0, 1.0), (20.0, 4.0), (80.0, 0.3)])
def test_the_shadow_of_a_standing_cylinder_matches_rays(polar, lamp_radius):
    params = sample(object__shape="cylinder")
    radius, top = params.object.depth_m / 2, params.object.height_m / 2
    polar = np.radians(polar)
    lamp = 30 * np.array([0.5 * np.sin(polar), 0.866 * np.sin(polar), np.cos(polar)])
    outline = outline_of(
        prepare_facets(*surface_of(params)), np.array([0, 0, top]), np.eye(3), lamp, np.array([0, -1.0, -0.3])
    )
    rng = np.random.default_rng(0)
    points = np.concatenate([rng.uniform((-0.2, -0.2), (0.05, 0.05), (3000, 2)), np.zeros((3000, 1))], 1)
    points = points[np.hypot(points[:, 0], points[:, 1]) > radius + 0.0005]
    casters = [(np.array([0, 0, top]), np.eye(3), partial(cylinder, radius, top))]
    error = np.abs(seen(points, outline, lamp_radius) - seen_share(points, lamp, lamp_radius, casters, 200, rng))
    assert error.mean() < 0.001
    assert np.quantile(error, 0.99) < 0.04
    assert error.max() < 0.2


def test_a_pixel_blurs_the_shadow_as_its_mean_does():
    params = sample(object__shape="cylinder")
    top = params.object.height_m / 2
    lamp = np.array([12.0, 21.0, 17.0])
    outline = outline_of(
        prepare_facets(*surface_of(params)), np.array([0, 0, top]), np.eye(3), lamp, np.array([0, -1.0, -0.3])
    )
    right, down = np.array([-0.0008, 0, 0]), np.array([0, 0.008, 0])
    rows = outline.frames[0].T @ np.stack([right, down], 1)
    blur = 0.5 * np.hypot(rows[:2, 0], rows[:2, 1])
    y = np.linspace(-0.12, 0.0, 60)
    points = np.concatenate([np.stack([np.full(60, x), y, np.zeros(60)], 1) for x in (-0.05, -0.02, 0.0, 0.02)])
    points = points[np.hypot(points[:, 0], points[:, 1]) > params.object.depth_m / 2 + 0.005]
    steps = (np.arange(12) + 0.5) / 12 - 0.5
    inside = points[:, None, None] + steps[:, None, None] * right + steps[:, None] * down
    mean = seen(inside.reshape(-1, 3), outline, 1.0).reshape(len(points), -1).mean(1)
    error = seen(points, outline, 1.0, blur) - mean
    assert np.abs(error).mean() < 0.01
    assert np.abs(error).max() < 0.1
    assert abs(error.mean()) < 0.004


def coverage(params, traj):
    camera = hand_camera(params)
    poses = ScenePoses(traj, camera, np.array([700_000]))
    raycaster = Raycaster(params, camera, float(poses.travel_m[0]))
    raycaster.draw(poses, 0)
    assert isinstance(raycaster._body, Mesh)
    frame = poses.camera_position[0], poses.camera_rotation[0]
    steps = (np.arange(5) + 0.5) / 5
    x = ((np.arange(camera.width)[:, None] + steps).ravel() - camera.width / 2) / camera.focal_px
    y = (camera.height / 2 - (np.arange(camera.height)[:, None] + steps).ravel()) / camera.focal_px
    rays = np.stack([*np.meshgrid(x, y), -np.ones((5 * camera.height, 5 * camera.width))], -1).reshape(-1, 3)
    origin = (frame[0] - poses.object_position[0]) @ poses.object_rotation[0]
    rays = rays @ frame[1].T @ poses.object_rotation[0]
    hit = np.isfinite(triangles(*surface_of(params), origin, rays)[0])
    return raycaster._body, hit.reshape(camera.height, 5, camera.width, 5).mean((1, 3))


@pytest.mark.parametrize("shape", ["cylinder", "ring"])
def test_every_pixel_gets_its_share_of_the_mesh(shape, ring):
    params = sample(**(ring if shape == "ring" else {"object__shape": "cylinder"}))
    drawn, hit = coverage(params, turning(params))
    error = drawn.total - hit
    assert np.abs(error).max() < 0.2
    assert abs(error.sum()) < 0.002 * hit.sum()
    shares = np.zeros(drawn.total.size)
    count = drawn._count
    np.add.at(shares, drawn._raster.fragment_pixel[:count], drawn._raster.fragment_share[:count])
    assert shares.reshape(hit.shape) == pytest.approx(drawn.total, abs=1e-5)
    for row in range(len(hit)):
        columns = np.flatnonzero(drawn.total[row])
        assert not len(columns) or (drawn.touched[row, 0] <= columns[0] and columns[-1] < drawn.touched[row, 1])
        assert np.all(drawn.total[row, drawn.full[row, 0] : drawn.full[row, 1]] == 1)


@pytest.mark.parametrize(("polar", "azimuth"), [(20.0, 60.0), (70.0, 200.0)])
@pytest.mark.parametrize("place", [turning, on_the_table])
def test_a_cylinder_matches_brute_force(polar, azimuth, place, monkeypatch):
    params = sample(object__shape="cylinder", light__polar_deg=polar, light__azimuth_deg=azimuth)
    shape = partial(cylinder, params.object.depth_m / 2, params.object.height_m / 2)
    check(*compare(params, place(params), 700_000, monkeypatch, shape))


def test_a_ring_matches_brute_force(ring, monkeypatch):
    params = sample(light__polar_deg=30.0, light__azimuth_deg=100.0, **ring)
    log_error, error, bodies = compare(
        params, turning(params), 700_000, monkeypatch, partial(triangles, *surface_of(params))
    )
    check(log_error, error, bodies)


def check(log_error, error, bodies):
    assert np.percentile(np.abs(log_error), 95) < 0.055
    assert np.sqrt(np.mean(error**2)) < 0.014
    for name in (BACKGROUND, SURFACE, OBJECT):
        assert abs(np.mean(log_error[bodies == name])) < 0.012


def test_the_gripper_stands_before_and_behind_a_cylinder():
    params = sample(object__shape="cylinder")
    camera = hand_camera(params)
    poses = ScenePoses(still(params), camera, np.array([0]))
    raycaster = Raycaster(params, camera, float(poses.travel_m[0]))
    poses.object_position[0] += (0, 0, 0.05)
    raycaster.draw(poses, 0)
    layers = raycaster._openings.at(float(poses.travel_m[0])).layers
    shown = raycaster._body.total.reshape(-1)[np.repeat(layers.pixels, np.diff(layers.starts))] == 1
    depth = -layers.fragments[2]
    before, behind = shown & (depth < 0.268 - params.object.depth_m / 2), shown & (depth > 0.27)
    assert before.sum() > 100 and np.all(raycaster._front[before] == 1)
    assert behind.sum() > 50 and np.all(raycaster._front[behind] == 0)


@pytest.mark.parametrize("place", [turning, on_the_table])
def test_a_box_looks_the_same_as_cuboid_and_as_mesh(place, monkeypatch):
    params = sample(light__polar_deg=55.0, light__azimuth_deg=60.0)
    camera = hand_camera(params)
    poses = ScenePoses(place(params), camera, np.array([700_000]))
    cuboid, bodies = Raycaster(params, camera, float(poses.travel_m[0])).draw(poses, 0)
    monkeypatch.setitem(body.BODIES, "cuboid", body.Mesh)
    mesh, mesh_bodies = Raycaster(params, camera, float(poses.travel_m[0])).draw(poses, 0)
    difference = np.abs(np.log(mesh / cuboid))
    assert np.mean(bodies == mesh_bodies) > 0.998
    assert np.quantile(difference[bodies == OBJECT], 0.95) < 0.02
    assert np.quantile(difference, 0.99) < 0.1
    assert np.quantile(difference, 0.9) < 0.002


@pytest.mark.parametrize("shape", ["cylinder", "ring"])
@pytest.mark.parametrize("lowered_m", [(0.1, -0.1), (-0.1, 0.3)], ids=["in the grip", "past it"])
def test_a_mesh_does_not_depend_on_what_was_drawn_before(shape, lowered_m, ring):
    params = sample(**(ring if shape == "ring" else {"object__shape": "cylinder"}))
    camera, traj = hand_camera(params), turning(params)
    traj.object_pose[:, 2] -= np.linspace(*lowered_m, len(traj.t_us))
    poses = ScenePoses(traj, camera, np.arange(0, 1_000_001, 100_000))
    raycaster = Raycaster(params, camera, float(poses.travel_m[0]))
    every = [raycaster.draw(poses, index) for index in range(11)]
    for index in (9, 4, 0, 7):
        again = raycaster.draw(poses, index)
        alone = Raycaster(params, camera, float(poses.travel_m[0])).draw(poses, index)
        for k in range(2):
            assert again[k].tobytes() == every[index][k].tobytes() == alone[k].tobytes()


@pytest.mark.parametrize(("wide", "high"), [(0.1, 0.1), (0.3, 0.1), (0.04, 0.1)])
def test_a_repetition_of_the_texture_is_as_wide_and_high_as_on_the_mesh(wide, high):
    box = trimesh.creation.box((0.05, 0.07, 0.11))
    corners = np.asarray(box.triangles)
    across = corners[:, 1] - corners[:, 0]
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    up = np.cross(box.face_normals, across)
    uv = np.stack([np.einsum("fki,fi->fk", corners, axis) for axis in (across, up)], -1) / (wide, high)
    normals = np.repeat(np.asarray(box.face_normals)[:, None], 3, 1)
    assert repetition_ratio(prepare_facets(box.vertices, box.faces, uv, normals)) == pytest.approx(wide / high)
    assert repetition_ratio(prepare_facets(box.vertices, box.faces, 0 * uv, normals)) == 1.0
