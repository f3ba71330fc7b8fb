"""Where pads touch an object, against contact mechanics."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

import evslip
from evslip.config.section import Within
from evslip.config.sections.grip import GripSpec
from evslip.generation.generate import check_reach
from evslip.physics.contact import FINE_CELLS, PAD_HALF_M, PAD_STIFFNESS_PA_M
from evslip.physics.grip import LEFT, RIGHT, contact_elements, grasp, open_travel_m, planned_grasp
from evslip.physics.limit_surface import LimitSurface
from evslip.utils.errors import PlanRejected
from pads import contact_patch


def params_with(**values):
    overrides = {"object.width_m": 0.05, "object.height_m": 0.08, "object.mass_kg": 0.03, "grip.offset": 0.0}
    overrides |= {"grip.depth_m": 0.02} | {key.replace("__", "."): value for key, value in values.items()}
    return evslip.draw(evslip.load_config("simple", overrides), 0)


def with_mesh(folder, body, **values):
    path = folder / "body.stl"
    body.export(path)
    return params_with(object__shape="mesh", object__mesh=str(path), object__mesh_fit="own", **values)


@settings(max_examples=15)
@given(radius=st.floats(0.01, 0.035), force=st.floats(0.5, 20), offset=st.floats(-0.5, 0.5))
def test_a_cylinder_is_touched_along_the_strip_of_an_elastic_foundation(radius, force, offset):
    params = params_with(object__shape="cylinder", object__depth_m=2 * radius, grip__force_n=force, grip__offset=offset)
    half_width = (3 * radius * force / (2 * PAD_STIFFNESS_PA_M * 2 * PAD_HALF_M)) ** (1 / 3)
    x0, x1, z0, z1 = contact_patch(params)
    assert (z0, z1) == pytest.approx((-PAD_HALF_M, PAD_HALF_M), abs=1e-6)
    assert (x1 - x0) / 2 == pytest.approx(half_width, rel=0.12)
    points, weights = contact_elements(params)
    assert weights.sum() == pytest.approx(1)
    across = points[:, 0] - weights @ points[:, 0]
    assert np.sqrt(weights @ across**2) == pytest.approx(half_width / np.sqrt(5), rel=0.05)  # of a parabola
    assert weights @ points[:, 0] == pytest.approx(-0.9 * PAD_HALF_M * offset, abs=2e-5)


@settings(max_examples=10)
@given(offset=st.floats(-0.9, 0.9), depth=st.floats(-0.005, 0.02))
def test_a_box_from_a_file_is_gripped_like_a_cuboid(tmp_path_factory, offset, depth):
    grip = {"grip__offset": offset, "grip__depth_m": depth}
    box = trimesh.creation.box((0.05, 0.05, 0.08))
    mesh = with_mesh(tmp_path_factory.mktemp("box"), box, **grip)
    cuboid = params_with(**grip)
    assert contact_patch(mesh) == pytest.approx(contact_patch(cuboid), abs=PAD_HALF_M / FINE_CELLS)
    assert grasp(mesh).pads[LEFT].slab == pytest.approx(np.array([[-0.025, -0.04], [0.025, 0.04]]), abs=1e-6)
    directions = np.random.default_rng(0).normal(size=(200, 3)) * [1, 1, 0.006]
    surfaces = (LimitSurface.of(*contact_elements(params)) for params in (mesh, cuboid))
    carried = [surface.utilisation(directions) for surface in surfaces]
    assert carried[0] == pytest.approx(carried[1], rel=0.06)


def ball(folder, **values):
    return with_mesh(folder, trimesh.creation.icosphere(subdivisions=4, radius=0.03), **values)


@pytest.mark.parametrize(
    "make",
    [
        lambda folder: params_with(object__shape="cylinder"),
        lambda folder: params_with(object__shape="cylinder", grip__depth_m=-0.003, grip__force_n=10.0),
        lambda folder: ball(folder, grip__depth_m=0.03),
    ],
)
def test_the_models_points_carry_what_the_patch_does(tmp_path, make):
    for pad in grasp(make(tmp_path)).pads:
        model, patch = (
            LimitSurface.of(pad.contacts, np.ones(len(pad.contacts))),
            LimitSurface.of(pad.points, pad.weights),
        )
        radius = np.sqrt(pad.weights @ ((pad.points - pad.weights @ pad.points) ** 2).sum(1))
        directions = np.random.default_rng(0).normal(size=(500, 3)) * [1, 1, radius]
        directions[:, 2] += pad.contacts.mean(0)[1] * directions[:, 0] - pad.contacts.mean(0)[0] * directions[:, 1]
        ratio = model.utilisation(directions) / patch.utilisation(directions)
        assert 0.85 < ratio.min() <= ratio.max() < 1.2


def test_the_pads_of_an_uneven_body_touch_different_places(tmp_path):
    # A block with a rib along the side y < 0 and a lower one, farther down, along the other.
    profile = [[-0.015, -0.04], [0.015, -0.04], [0.015, 0.01], [0.02, 0.01], [0.02, 0.014], [0.015, 0.014]]
    profile += [[0.015, 0.04], [-0.015, 0.04], [-0.015, 0.022], [-0.025, 0.022], [-0.025, 0.018], [-0.015, 0.018]]
    body = extruded(profile, 0.05)
    params = with_mesh(tmp_path, body, grip__depth_m=0.024)
    left, right = planned_grasp(params).pads
    # The bounding box is 45 mm deep, its middle at y = -2.5 mm of the profile.
    assert (left.face_m, right.face_m) == pytest.approx((0.0225, 0.0225), abs=1e-6)
    assert left.corners[:, 1] == pytest.approx([0.002, 0.006], abs=4e-4)
    assert right.corners[:, 1] == pytest.approx([-0.006, -0.002], abs=4e-4)
    above = with_mesh(tmp_path, body, grip__depth_m=0.015)
    assert planned_grasp(above).pads[RIGHT].face_m == pytest.approx(0.0175, abs=1e-6)
    assert planned_grasp(above).gap_m == pytest.approx(0.04, abs=1e-6)
    assert planned_grasp(above).middle_m == pytest.approx(-0.0025, abs=1e-6)
    assert open_travel_m(above) == pytest.approx(0.0225 + 0.0025 + 0.006)


def test_a_mesh_that_was_edited_is_gripped_as_it_is_now(tmp_path):
    params = with_mesh(tmp_path, trimesh.creation.box((0.05, 0.05, 0.08)))
    flat = planned_grasp(params), grasp(params)
    trimesh.creation.cylinder(0.025, 0.08, sections=128).export(tmp_path / "body.stl")
    for before, now in zip(flat, (planned_grasp(params), grasp(params)), strict=True):
        assert np.ptp(now.pads[LEFT].points[:, 0]) < 0.5 * np.ptp(before.pads[LEFT].points[:, 0])


def extruded(profile, width):
    """A prism along x over a polygon (y, z), anticlockwise."""
    count = len(profile)
    ring = np.array(profile)
    vertices = np.concatenate([np.c_[np.full(count, x), ring] for x in (-width / 2, width / 2)])
    k = np.arange(count)
    after = (k + 1) % count
    sides = np.concatenate([np.c_[k, after, after + count], np.c_[k, after + count, k + count]])
    ends = np.array(triangulated(ring))
    faces = np.concatenate([sides, ends[:, ::-1], ends + count])
    return trimesh.Trimesh(vertices, faces, process=False)


def triangulated(ring):
    """Ears cut off a simple anticlockwise polygon."""
    left, ears = list(range(len(ring))), []
    while len(left) > 2:
        for position in range(len(left)):
            a, b, c = (left[(position + k) % len(left)] for k in (-1, 0, 1))
            others = [ring[p] for p in left if p not in (a, b, c)]
            if turn(ring[a], ring[b], ring[c]) > 0 and not any(within(ring[[a, b, c]], p) for p in others):
                ears.append((a, b, c))
                left.pop(position)
                break
    return ears


def turn(a, b, c):
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def within(corners, point):
    return all(turn(corners[k], corners[(k + 1) % 3], point) >= 0 for k in range(3))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda folder: params_with(grip__error_x_m=0.03, grip__offset=-0.9), "the pads miss the object"),
        (lambda folder: ball(folder, grip__depth_m=-0.0074), "the pads miss the object|too steep"),
        (lambda folder: ball(folder, grip__depth_m=0.003), "too steep for grip.friction 0.5"),
        (lambda folder: ball(folder, grip__depth_m=0.03, grip__offset=0.9), "slope of more than 27 deg"),
        (
            lambda folder: params_with(grip__error_y_m=0.007),
            r"grip\.error_y_m 0\.007.*a finger comes down",
        ),
        (lambda folder: params_with(object__depth_m=0.075, grip__error_yaw_deg=12.0), "a finger comes down"),
    ],
)
def test_a_grip_that_cannot_hold_is_rejected_with_the_reason(tmp_path, make, words):
    with pytest.raises(PlanRejected, match=words) as caught:
        check_reach(make(tmp_path))
    assert caught.value.kind == "grip"


def test_a_misplaced_object_is_gripped_where_it_stands():
    params = params_with(grip__error_x_m=0.02, grip__error_yaw_deg=2.0, grip__offset=-0.5)
    offset = -0.5 * 0.9 * 0.025 - 0.02
    assert grasp(params).point_m == pytest.approx([np.cos(np.radians(2)) * offset, 0.02])
    assert contact_patch(params)[0] == pytest.approx(-0.025 - grasp(params).point_m[0])
    assert planned_grasp(params).point_m[0] == pytest.approx(-0.5 * 0.9 * 0.025)


def cup(folder, **values):
    """A mesh with upright walls and no bottom half: nothing like its convex hull."""
    profile = [[0, 0.03], [0.025, 0.03], [0.025, 0.08], [0.022, 0.08], [0.022, 0.033], [0, 0.033]]
    stem = trimesh.creation.revolve(np.array([[0, 0], [0.02, 0], [0.02, 0.002], [0.006, 0.03], [0, 0.03]]), sections=64)
    bowl = trimesh.creation.revolve(np.array(profile), sections=64)
    return with_mesh(folder, trimesh.util.concatenate([stem, bowl]), **values)


@pytest.mark.parametrize(
    "make",
    [
        lambda folder: params_with(object__shape="cylinder", grip__offset=0.5),
        lambda folder: cup(folder, grip__depth_m=0.02),
        lambda folder: params_with(object__com_x_m=0.012, object__com_z_m=-0.02),
        lambda folder: cup(folder, grip__depth_m=0.02, object__com_x_m=0.01, grip__error_y_m=0.002),
    ],
    ids=["cylinder", "cup", "off-centre cuboid", "off-centre, misplaced cup"],
)
def test_an_object_holds_below_its_onset_and_slips_above(tmp_path, make):
    params = make(tmp_path)
    onset_kg = evslip.onset_mass(params)
    slipped = []
    for factor in (0.85, 1.25):
        heavier = params.object.model_copy(update={"mass_kg": factor * onset_kg})
        trajectory = evslip.simulate(params.model_copy(update={"object": heavier}))
        slipped.append(evslip.measure(trajectory).onset_us is not None)
    assert slipped == [False, True]


def test_the_hand_closes_around_the_middle_of_what_it_grips(tmp_path):
    profile = [[-0.015, -0.04], [0.015, -0.04], [0.015, 0.04], [-0.015, 0.04], [-0.015, 0.022], [-0.025, 0.022]]
    profile += [[-0.025, 0.018], [-0.015, 0.018]]
    params = with_mesh(tmp_path, extruded(profile, 0.05), grip__depth_m=0.02, object__mass_kg=0.02)
    trajectory = evslip.simulate(params)
    held = evslip.measure(trajectory).held
    assert np.abs(trajectory.object_pose[held, 1][0] - params.object.y_m) < 2e-4
    assert trajectory.joints[held, 7:].sum(axis=1) == pytest.approx(np.full(held.sum(), 0.04), abs=2.5e-3)
    assert trajectory.pad_force_n[held] == pytest.approx(np.ones((held.sum(), 2)), abs=0.05)


def test_the_highest_grip_leaves_a_millimetre_of_the_pads_on_the_object():
    limits = next(limit for limit in GripSpec.model_fields["depth_m"].metadata if isinstance(limit, Within))
    assert limits.low == pytest.approx(0.001 - PAD_HALF_M)
