"""Plastic, film and metal on the object, against a sum over the lamp's disc and in frames."""

import importlib

import numpy as np
import pytest

from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.events.frame import OBJECT
from evslip.rendering import render
from evslip.rendering.materials.paint import FINISHES, Finish, gloss_of_object
from evslip.rendering.shading.highlights import finished_light, mirror_points
from made_up import carried

render_module = importlib.import_module("evslip.rendering")  # as an attribute of evslip, that name is the function
SHINY = tuple(FINISHES)
OPEN_SKY = np.diag([0.0, 0.0, 0.0, 100.0]).astype(np.float32)
"""Ambient light of the same luminance all around."""
NOON_M, LAMP_RADIUS_M = np.array([0.0, 0.0, 30.0]), 1.0
CAMERA_M = np.array([0.3, 0.0, 0.4])
LARGE = {"object__width_m": 0.07, "object__height_m": 0.11, "light__polar_deg": 84.0, "camera__exposure": "absolute"}


def sample(**overrides):
    changes = {key.replace("__", "."): value for key, value in overrides.items()}
    return draw(load_config("simple", {"camera.width": 138, "camera.height": 104, **changes}), 0)


def luminance_of(params, at_us=0):
    (frame,) = render(carried(params), times_us=np.array([at_us]))
    return frame.luminance, frame.bodies == OBJECT


@pytest.fixture(autouse=True)
def whole_span(monkeypatch):
    """Made-up trajectories carry no grip, so all of them counts as recorded."""
    monkeypatch.setattr(render_module, "recorded_span", lambda traj: (int(traj.t_us[0]), int(traj.t_us[-1])))


def mirrored(normals, roughness):
    """`mirror_points` of a point at the origin with normals (n, 3), seen from CAMERA_M, with the lamp at NOON_M."""
    count = len(normals)
    places = np.repeat(-CAMERA_M[:, None], count, 1).astype(np.float32)
    lamp = (NOON_M - CAMERA_M).astype(np.float32)
    lit = normals.T.astype(np.float32), lamp, np.float32(LAMP_RADIUS_M), OPEN_SKY, np.float32(roughness)
    return mirror_points(places, *lit)


def summed_over_the_disc(normals, roughness, count=4000):
    """The first two rows of `mirror_points` by the definition: lobe times pi, and Schlick's share, for (n, 3)."""
    k = np.arange(count) + 0.5
    ring, turn = LAMP_RADIUS_M * np.sqrt(k / count), 2.399963 * k
    disc = NOON_M + np.stack([ring * np.cos(turn), ring * np.sin(turn), 0 * turn], 1)
    light = disc / np.linalg.norm(disc, axis=1, keepdims=True)
    view = CAMERA_M / np.linalg.norm(CAMERA_M)
    half = light + view
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    square = roughness**4
    towards_light, towards_view = normals @ light.T, (normals @ view)[:, None]
    facets = square / (np.pi * ((normals @ half.T) ** 2 * (square - 1) + 1) ** 2)
    seen = [2 * c / (c + np.sqrt(square + (1 - square) * c**2)) for c in (towards_light, towards_view)]
    lobe = facets * seen[0] * seen[1] / (4 * towards_light * towards_view)
    received = towards_light / (normals @ [0.0, 0.0, 1.0])[:, None]
    return np.pi * np.mean(lobe * received, 1), np.mean((1 - half @ view) ** 5)


def tilted_from_the_middle(angles):
    """Normals that stand by angles, in every direction, beside the one in which the highlight is brightest."""
    middle = CAMERA_M / np.linalg.norm(CAMERA_M) + [0.0, 0.0, 1.0]
    middle /= np.linalg.norm(middle)
    across = np.cross(middle, [0.0, 1.0, 0.0])
    turn = np.arange(16) / 16 * 2 * np.pi
    ring = np.cos(turn)[:, None] * across + np.sin(turn)[:, None] * np.cross(middle, across)
    return (np.cos(angles)[:, None, None] * middle + np.sin(angles)[:, None, None] * ring).reshape(-1, 3)


@pytest.mark.parametrize("roughness", [0.1, 0.3, 0.6, 1.0])
def test_a_highlight_is_the_mean_over_the_lamps_disc(roughness):
    width = np.sqrt(roughness**4 + (LAMP_RADIUS_M / 30 / 2) ** 2)
    angles = np.linspace(0.0, min(4 * width, 0.5), 40)
    normals = tilted_from_the_middle(angles)
    found, wanted = mirrored(normals, roughness), summed_over_the_disc(normals, roughness)
    lobe, expected = (part.reshape(len(angles), 16).mean(1) for part in (found[0], wanted[0]))
    assert lobe[0] == pytest.approx(expected[0], rel=0.05)
    assert lobe @ np.sin(angles) == pytest.approx(expected @ np.sin(angles), rel=0.15)
    assert found[1] == pytest.approx(wanted[1], abs=1e-6)


def test_a_white_metal_in_an_even_sky_looks_like_matt_white():
    count = 50
    normals = tilted_from_the_middle(np.linspace(0.0, 0.6, count // 10))[:count]
    even, nothing = np.full(len(normals), 100.0, np.float32), np.zeros(len(normals), np.float32)
    mirrors = mirrored(normals, 0.4)
    received, added = finished_light(Finish(0.04, 1.0, 0.4), even, nothing, np.ones_like(even), mirrors)
    assert received + added == pytest.approx(100.0, rel=1e-4)
    received, added = finished_light(Finish(0.04, 0.0, 0.4), even, nothing, np.ones_like(even), mirrors)
    assert np.array_equal(received, even)
    assert added == pytest.approx(4.0, rel=0.2)


def test_narrower_highlights_are_brighter():
    by_roughness = [mirrored(tilted_from_the_middle(np.zeros(1)), roughness)[0, 0] for roughness in (0.1, 0.3, 0.6)]
    assert by_roughness[0] > 3 * by_roughness[1] > 9 * by_roughness[2]


def test_a_finish_replaces_the_textures_own():
    for texture in ("wood-0", "cardboard-0"):
        assert gloss_of_object(sample(object__texture=texture, object__finish="matt").object) == 0.0
        for name in SHINY:
            assert gloss_of_object(sample(object__texture=texture, object__finish=name).object) == FINISHES[name]
    own = sample(object__finish="film", object__roughness=0.2).object
    assert gloss_of_object(own) == FINISHES["film"]._replace(roughness=0.2)


def test_matt_is_what_a_matt_texture_is():
    lamp = LARGE | {"light__azimuth_deg": 262.0}
    for texture, is_matt in (("cardboard-0", True), ("wood-0", False)):
        drawn, matt = (
            luminance_of(sample(**lamp, object__texture=texture, object__finish=f)) for f in ("texture", "matt")
        )
        assert np.array_equal(drawn[0], matt[0]) == is_matt


@pytest.mark.parametrize(("shape", "azimuth"), [("cuboid", 262.0), ("cylinder", 330.0)])
@pytest.mark.parametrize("finish", SHINY)
def test_highlights_run_over_what_the_hand_holds_still(shape, azimuth, finish):
    """The camera turns with hand and object, the lamp does not: the same pixels show the object, another place
    shines."""
    scene = LARGE | {"object__shape": shape, "light__azimuth_deg": azimuth, "object__texture": "noise-0"}
    brightest = []
    for at_us in (0, 990_000):
        (shiny, body), (matt, _) = (luminance_of(sample(**scene, object__finish=f), at_us) for f in (finish, "matt"))
        brightest.append(np.unravel_index(np.where(body, shiny - matt, -np.inf).argmax(), body.shape))
        assert np.isfinite(shiny).all() and shiny.min() > 0
        assert shiny[brightest[-1]] > 2 * matt[brightest[-1]]
    assert np.hypot(*np.subtract(*brightest)) > 3
