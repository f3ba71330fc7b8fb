"""Shapes: volumes, surfaces, profiles and mesh files against analysis and brute force."""

import itertools

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from trimesh.visual import TextureVisuals

import evslip
from evslip.physics.inertia import inertia_kg_m2, second_moment_m2
from evslip.scene.shapes import SHAPES, shape_of, surface_of
from evslip.scene.shapes.mesh_file import load_mesh
from evslip.scene.shapes.surface import box_uv, corner_normals
from evslip.utils.errors import ConfigError


@pytest.fixture(scope="module")
def cup(tmp_path_factory):
    profile = [[0, 0], [0.02, 0], [0.022, 0.004], [0.025, 0.08], [0.0225, 0.08], [0.02, 0.006], [0, 0.006]]
    path = tmp_path_factory.mktemp("mesh") / "cup.stl"
    trimesh.creation.revolve(np.array(profile), sections=64).export(path)
    return str(path)


def params_with(**values):
    overrides = {"object.width_m": 0.05, "object.height_m": 0.08, "object.mass_kg": 0.03, "grip.offset": 0.0}
    overrides |= {"grip.depth_m": 0.02} | {key.replace("__", "."): value for key, value in values.items()}
    return evslip.draw(evslip.load_config("simple", overrides), 0)


def of_shape(name, cup, **values):
    return params_with(object__shape=name, **({"object__mesh": cup} if name == "mesh" else {}), **values)


@pytest.fixture(params=SHAPES)
def params(request, cup):
    return of_shape(request.param, cup)


def solid(params):
    surface = surface_of(params)
    return trimesh.Trimesh(surface.vertices, surface.faces, process=False)


def test_the_surface_is_closed_and_fills_the_bounding_box(params):
    body, size = solid(params), params.object
    assert body.is_volume
    assert body.volume > 0
    assert body.bounds[1] == pytest.approx([size.width_m / 2, size.depth_m / 2, size.height_m / 2])
    assert body.bounds[0] == pytest.approx(-body.bounds[1])


def test_normals_point_outwards_and_the_image_is_not_mirrored(params):
    surface, body = surface_of(params), solid(params)
    assert np.linalg.norm(surface.normals, axis=2) == pytest.approx(np.ones((len(surface.faces), 3)))
    assert np.sum(surface.normals * body.face_normals[:, None], axis=2).min() > 0.8
    (a, b), (c, d) = (surface.uv[:, k] - surface.uv[:, 0] for k in (1, 2)), (0, 1)
    assert (a[:, c] * b[:, d] - a[:, d] * b[:, c] < 1e-12).all()  # u to the right, v down


def test_the_filling_is_that_of_the_surface(params):
    filling, body = shape_of(params).volume_moments(), solid(params)
    spread = np.trace(filling.second_moment_m2) * np.eye(3) - filling.second_moment_m2
    near = 3e-3 if params.object.shape == "cylinder" else 1e-6  # 64 facets for a circle
    assert filling.volume_m3 == pytest.approx(body.volume, rel=near)
    assert filling.centroid_m == pytest.approx(body.center_mass, abs=1e-9)
    assert spread == pytest.approx(body.moment_inertia / body.volume, rel=near, abs=1e-10)


def test_the_outline_contains_the_body(params):
    hull = trimesh.Trimesh(shape_of(params).outline()).convex_hull
    offsets = np.sum(hull.face_normals * hull.triangles[:, 0], axis=1)
    assert (surface_of(params).vertices @ hull.face_normals.T - offsets).max() < 1e-7


@settings(max_examples=20)
@given(x=st.floats(-0.02, 0.02), z=st.floats(-0.03, 0.03), step=st.floats(1e-4, 2e-3), side=st.sampled_from([-1, 1]))
def test_heights_of_a_mesh_are_those_of_rays(cup, x, z, step, side):
    params = of_shape("mesh", cup)
    lines = np.arange(4) * step
    heights = shape_of(params).heights(side, x + lines, z + lines)
    a, b, c = solid(params).triangles.transpose(1, 0, 2)
    for i, j in itertools.product(range(4), repeat=2):
        point = np.array([x + lines[i], z + lines[j]])
        sides = [
            (q - p)[:, 0] * (point[1] - p[:, 2]) - (q - p)[:, 2] * (point[0] - p[:, 0])
            for p, q in ((a, b), (b, c), (c, a))
        ]
        crossed = np.all([s >= 0 for s in sides], axis=0) | np.all([s <= 0 for s in sides], axis=0)
        normal = np.cross(b - a, c - a)
        crossed &= np.abs(normal[:, 1]) > 1e-15
        y = a[crossed, 1] - ((point - a[crossed][:, [0, 2]]) * normal[crossed][:, [0, 2]]).sum(1) / normal[crossed, 1]
        assert heights[i, j] == pytest.approx((side * y).max(initial=-np.inf), abs=1e-9)


def test_a_cylinder_is_round_and_a_mesh_takes_the_size_that_is_asked_for(cup):
    assert of_shape("cylinder", cup, object__width_m=0.03).object.width_m == 0.05
    stretched = of_shape("mesh", cup, object__width_m=0.03).object
    even = of_shape("mesh", cup, object__mesh_fit="height", object__height_m=0.06).object
    own = of_shape("mesh", cup, object__mesh_fit="own", object__height_m=0.06).object
    assert (stretched.width_m, stretched.depth_m, stretched.height_m) == (0.03, 0.05, 0.08)
    assert (even.width_m, even.depth_m, even.height_m) == pytest.approx((0.0375, 0.0375, 0.06), rel=1e-3)
    assert (own.width_m, own.depth_m, own.height_m) == pytest.approx((0.05, 0.05, 0.08), rel=1e-3)


def test_a_density_becomes_a_mass(params, cup):
    spec = params.object
    dense = of_shape(spec.shape, cup, object__density_kg_m3=500.0).object
    assert dense.mass_kg == pytest.approx(500 * shape_of(params).volume_moments().volume_m3)
    assert dense.density_kg_m3 is None


def test_an_even_cuboid_has_the_inertia_of_the_books():
    params = params_with()
    expected = np.array([0.05**2 + 0.08**2, 0.05**2 + 0.08**2, 0.05**2 + 0.05**2]) * 0.03 / 12
    assert inertia_kg_m2(params) == pytest.approx(np.diag(expected))


@given(x=st.floats(-0.0249, 0.0249), z=st.floats(-0.0399, 0.0399))
@settings(max_examples=30)
def test_no_mass_reaches_beyond_the_object(x, z):
    params = params_with(object__com_x_m=x, object__com_z_m=z)
    spread = np.diag(second_moment_m2(params))
    centre, half = np.array([x, 0, z]), np.array([0.025, 0.025, 0.04])
    assert (spread <= half**2 / 3 + 1e-12).all()
    assert (spread <= (half - centre) * (half + centre) + 1e-12).all()  # two masses at the ends have this much


def test_a_mesh_keeps_its_own_texture_coordinates(tmp_path):
    box = trimesh.creation.box((0.04, 0.05, 0.08))
    uv = np.random.default_rng(0).random((8, 2))
    box.visual = TextureVisuals(uv=uv)
    path = tmp_path / "box.obj"
    box.export(path)
    surface = surface_of(params_with(object__shape="mesh", object__mesh=str(path), object__mesh_fit="own"))
    corners = surface.vertices[surface.faces].reshape(-1, 3).round(6).tolist()
    found = {tuple(corner): uv for corner, uv in zip(corners, surface.uv.reshape(-1, 2), strict=True)}
    for vertex, (u, v) in zip(box.vertices, uv, strict=True):
        assert found[tuple(vertex.round(6).tolist())] == pytest.approx((u, 1 - v), abs=1e-5)


def test_a_box_from_a_file_looks_like_a_cuboid(tmp_path):
    path = tmp_path / "box.ply"
    trimesh.creation.box((1, 2, 3)).export(path)
    cuboid, mesh = surface_of(params_with()), surface_of(params_with(object__shape="mesh", object__mesh=str(path)))

    def corners(surface):
        rows = np.concatenate([surface.vertices[surface.faces], surface.normals, surface.uv], axis=2).reshape(-1, 8)
        return np.unique(np.round(rows, 9) + 0.0, axis=0)

    assert corners(mesh) == pytest.approx(corners(cuboid))


def test_an_inverted_mesh_is_turned_outside_out(tmp_path):
    box = trimesh.creation.box((0.04, 0.05, 0.08))
    box.invert()
    box.export(tmp_path / "inverted.stl")
    params = params_with(object__shape="mesh", object__mesh=str(tmp_path / "inverted.stl"))
    assert solid(params).volume == pytest.approx(0.05 * 0.05 * 0.08)


def test_a_fan_of_many_faces_costs_no_memory_squared():
    count = 20_000
    angle = 2 * np.pi * np.arange(count) / count
    vertices = np.concatenate([np.c_[np.cos(angle), np.sin(angle), 0 * angle], [[0, 0, 1], [0, 0, -1]]])
    k = np.arange(count)
    after = (k + 1) % count
    faces = np.concatenate([np.c_[k, after, 0 * k + count], np.c_[after, k, 0 * k + count + 1]])
    normals = corner_normals(vertices, faces)
    assert np.linalg.norm(normals, axis=2) == pytest.approx(np.ones((2 * count, 3)))
    assert box_uv(vertices, faces).shape == (2 * count, 3, 2)


def write(path, kind):
    box = trimesh.creation.box((0.05, 0.05, 0.08))
    if kind == "open":
        box.faces = box.faces[:-1]
    elif kind == "twisted":
        box.faces[0] = box.faces[0][::-1]
    elif kind == "flat":
        box.apply_scale([1, 1e-6, 1])
    elif kind == "large":
        box.apply_scale([1, 2, 1])
    elif kind == "fine":
        box = trimesh.creation.icosphere(subdivisions=7)
    elif kind == "top":
        box = trimesh.creation.cone(0.025, 0.08)
        box.vertices *= [1, -1, -1]
    if kind == "text":
        path.write_text("no mesh")
    elif kind == "nan":
        path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 nan\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
    elif kind != "absent":
        box.export(path)


@pytest.mark.parametrize(
    ("kind", "suffix", "words"),
    [
        ("absent", ".stl", "there is no such file"),
        ("absent", ".doc", r"expected one of \.stl"),
        ("text", ".stl", "not a solid|cannot be read"),
        ("text", ".glb", "cannot be read"),
        ("nan", ".obj", "no numbers|cannot be read"),
        ("open", ".ply", "not watertight: 3 edges"),
        ("twisted", ".ply", "not watertight: faces of both orientations"),
        ("flat", ".ply", "has no volume"),
        ("fine", ".stl", "327,680 faces; expected at most 200,000"),
        ("large", ".ply", r"gives object\.depth_m 0\.1, expected 0\.005 to 0\.075; the Panda's hand opens to 0\.078 m"),
        ("top", ".stl", "falls over"),
    ],
)
def test_a_mesh_that_cannot_be_used_is_named_with_the_reason(tmp_path, kind, suffix, words):
    path = tmp_path / f"mesh{suffix}"
    write(path, kind)
    with pytest.raises(ConfigError, match=words) as caught:
        params_with(object__shape="mesh", object__mesh=str(path), object__mesh_fit="own")
    assert str(caught.value).startswith("object.mesh" if kind != "top" else "object.com")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"object__shape": "mesh"}, r"object\.mesh: this key is missing"),
        ({"object__shape": "cone"}, r"object\.shape: 'cone' is unknown; expected one of cuboid, cylinder, mesh"),
        ({"object__mass_kg": -1.0}, r"object\.mass_kg: -1 is out of range"),
        ({"object__depth_m": 0.09}, r"object\.depth_m: 0\.09 is out of range.*the Panda's hand opens to 0\.078 m"),
        ({"object__density_kg_m3": 25000.0}, r"object\.density_kg_m3: gives object\.mass_kg 5, expected 0\.001 to 2"),
        (
            {"object__com_x_m": 0.026, "object__com_z_m": 0.0},
            r"object\.com_x_m.*\(26\.0, 0\.0, 0\.0\) mm.*outside the object",
        ),
        ({"object__com_x_m": 0.02, "object__com_y_m": 0.02, "object__shape": "cylinder"}, "outside the object"),
    ],
)
def test_an_object_that_cannot_be_is_named_with_the_reason(values, words):
    with pytest.raises(ConfigError, match=words):
        params_with(**values)


@pytest.mark.parametrize("sections", [16, 24, 200])
def test_a_wheel_stands_however_coarse_its_mesh(tmp_path, sections):
    wheel = trimesh.creation.torus(0.03, 0.012, major_sections=sections, minor_sections=12)
    wheel.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))
    wheel.export(tmp_path / "wheel.stl")
    params = params_with(object__shape="mesh", object__mesh=str(tmp_path / "wheel.stl"), object__mesh_fit="own")
    assert shape_of(params).stands(np.zeros(3))
    assert not shape_of(params).stands(np.array([0.02, 0, 0]))


def test_a_mesh_that_was_edited_is_read_again(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    trimesh.creation.box((0.05, 0.05, 0.08)).export(tmp_path / "body.stl")
    params = params_with(object__shape="mesh", object__mesh="~/body.stl")
    shape, file = shape_of(params), load_mesh("~/body.stl")
    assert shape_of(params) is shape and load_mesh("~/body.stl") is file
    trimesh.creation.cylinder(0.025, 0.08, sections=128).export(tmp_path / "body.stl")
    assert len(load_mesh("~/body.stl").vertices) > len(file.vertices)
    assert shape_of(params).volume_moments().volume_m3 == pytest.approx(
        np.pi / 4 * shape.volume_moments().volume_m3, rel=1e-3
    )
    (tmp_path / "body.stl").unlink()
    with pytest.raises(ConfigError, match="no such file"):
        shape_of(params)
