import numpy as np
import pytest

from evslip.rendering.shading.ambient import irradiance, surround


def test_a_uniform_sky_over_a_uniform_table_has_a_closed_form():
    ambient = surround(np.full((8, 8), 0.5), 3000.0, 8, lamp=400.0, albedo=0.25)
    sky = 1500.0
    table = 0.25 * (sky + 400.0)
    assert ambient.surface == pytest.approx(sky, rel=1e-3)
    for angle in np.linspace(0, np.pi, 13):
        exact = sky * (1 + np.cos(angle)) / 2 + table * (1 - np.cos(angle)) / 2
        assert irradiance(ambient.matrix, np.sin(angle), 0.0, np.cos(angle)) == pytest.approx(exact, rel=0.03)


def test_matches_monte_carlo_under_a_textured_sky():
    rng = np.random.default_rng(0)
    sky = rng.uniform(0.2, 1.0, (4, 4)).repeat(4, 0).repeat(4, 1)
    ambient = surround(sky, 1.0, 2, lamp=0.5, albedo=0.3)
    z = rng.uniform(-1, 1, 200_000)
    turn = rng.uniform(0, 2 * np.pi, z.size)
    directions = np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], 1)
    elevation = np.arcsin(np.abs(z))
    rows = np.floor(-elevation / (2 * np.pi) * 2 * 16).astype(int) % 16
    columns = np.floor(turn / (2 * np.pi) * 2 * 16).astype(int) % 16
    radiance = np.where(z > 0, sky[rows, columns], 0.3 * (ambient.surface + 0.5))
    for normal in rng.normal(size=(8, 3)):
        normal /= np.linalg.norm(normal)
        exact = np.mean(4 * np.maximum(directions @ normal, 0) * radiance)
        assert irradiance(ambient.matrix, *normal) == pytest.approx(exact, rel=0.04)


@pytest.mark.parametrize("repetitions", [2, 8, 16, 24])
def test_a_sky_of_many_tiles_gives_the_mean_of_a_tile(repetitions):
    """Also where tiles, or spots on them, follow each other as regularly as the directions that are looked at."""
    stripes = np.broadcast_to(np.arange(64) // 8 % 2, (64, 64)).astype(float)
    ambient = surround(stripes, 1.0, repetitions, lamp=0.0, albedo=0.0)
    assert ambient.surface == pytest.approx(0.5, abs=0.04)


def test_no_side_receives_less_than_nothing():
    """Under a lamp in the dark, only the table sends light: what looks upwards has none, and a fit may miss that."""
    matrix = surround(np.zeros((8, 8)), 0.0, 8, lamp=3000.0, albedo=0.5).matrix
    normals = np.random.default_rng(0).normal(size=(20_000, 3))
    sides = np.column_stack([normals / np.linalg.norm(normals, axis=1, keepdims=True), np.ones(len(normals))])
    received = np.einsum("ni,ij,nj->n", sides, matrix, sides)
    assert received.min() >= 0 and received.max() == pytest.approx(1500.0, rel=0.03)
