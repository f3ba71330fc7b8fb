"""What a glossy table mirrors, against random directions and against the path tracer's own figures."""

import numpy as np
import pytest

from evslip.rendering.geometry.plane import describe
from evslip.rendering.materials.paint import REFLECTANCE, WIDTH, gloss_of
from evslip.rendering.shading.environment_reflection import TERMS, fit_reflection, glint, mirror
from evslip.rendering.slots import GLOSS, LIT, RESULT, SCRATCH, U, V

ANGLES = np.radians([5.0, 30.0, 60.0, 75.0, 85.0])


def lobe(light, view):
    """Trowbridge and Reitz's microfacets, as luminance for unit illuminance: light, view (n, 3) unit vectors."""
    alpha, half = float(WIDTH), light + view
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    spread = alpha**2 / (np.pi * (half[:, 2] ** 2 * (alpha**2 - 1) + 1) ** 2)

    def shadowed(cosine):
        tangent = (1 - cosine**2) / cosine**2
        return 2 / (1 + np.sqrt(1 + alpha**2 * tangent))

    fresnel = float(REFLECTANCE) + (1 - float(REFLECTANCE)) * (1 - np.sum(half * view, 1)) ** 5
    both = shadowed(light[:, 2]) * shadowed(view[:, 2])
    return spread * fresnel * both / (4 * light[:, 2] * view[:, 2])


@pytest.mark.parametrize("sky", [np.full(32, 100.0), np.linspace(300, 10, 32)], ids=["even", "bright horizon"])
def test_a_table_mirrors_what_rays_to_the_sky_find(sky):
    rng = np.random.default_rng(0)
    height, azimuth = rng.uniform(0, 1, 400_000), rng.uniform(0, 2 * np.pi, 400_000)
    across = np.sqrt(1 - height**2)
    light = np.stack([across * np.cos(azimuth), across * np.sin(azimuth), height], 1)
    radiance = sky[(height * len(sky)).astype(int)]
    polynomial = fit_reflection(sky, float(WIDTH), float(REFLECTANCE))
    assert polynomial.shape == (TERMS,)
    for angle in ANGLES:
        view = np.tile([np.sin(angle), 0, np.cos(angle)], (len(light), 1))
        rays = 2 * np.pi * np.mean(lobe(light, view) * height * radiance)
        found = np.polynomial.polynomial.polyval(1 - np.cos(angle), polynomial.astype(float))
        assert found == pytest.approx(rays, rel=0.05, abs=0.02 * sky.mean() * float(REFLECTANCE))


def looked_at(angle):
    """The scratch and the plane of a table that a camera straight above the origin's left sees under an angle."""
    camera = np.array([-np.tan(angle), 0.0, 1.0])
    turn = np.stack([[0.0, -1.0, 0.0], [np.cos(angle), 0.0, np.sin(angle)], [-np.sin(angle), 0.0, np.cos(angle)]], 1)
    plane = describe(np.zeros(3), np.eye(3), turn, camera)
    S = np.zeros(SCRATCH, np.float32)
    S[LIT] = 1
    return S, plane, camera


@pytest.mark.parametrize("angle", ANGLES)
def test_the_lamps_glint_is_the_same_lobe(angle):
    """LIT is the luminance of white paper, pi times less than the illuminance."""
    lamp = 30 * np.array([np.sin(1.2), 0.2, np.cos(1.2)])
    S, plane, camera = looked_at(angle)
    glint(S, 1, plane, lamp.astype(np.float32), WIDTH, REFLECTANCE)
    light, view = lamp / np.linalg.norm(lamp), camera / np.linalg.norm(camera)
    assert S[GLOSS] == pytest.approx(np.pi * lobe(light[None], view[None])[0], rel=1e-3)
    assert S[U] == S[V] == 0


@pytest.mark.parametrize("angle", ANGLES)
def test_the_mirror_takes_the_polynomial_at_the_views_angle(angle):
    S, plane, _ = looked_at(angle)
    polynomial = fit_reflection(np.full(32, 100.0), float(WIDTH), float(REFLECTANCE))
    mirror(S, 1, plane, polynomial)
    want = np.polynomial.polynomial.polyval(1 - np.cos(angle), polynomial.astype(float))
    assert S[RESULT] == pytest.approx(want, rel=1e-3)


def test_only_some_textures_shine():
    assert gloss_of("wood-3", 0.2) == 0.2
    assert gloss_of("earth-1", 0.2) == gloss_of("my/photograph.png", 0.2) == 0.0
