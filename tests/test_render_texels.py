import numpy as np
import pytest

from evslip.rendering.lanes import LANES, MAJOR_U, MAJOR_V, MINOR_U, MINOR_V, SCRATCH, TEX, TEXELS, U, V
from evslip.rendering.texels import bake, sample


def lookup(image, u, v, texels, wrap=True, probes=(1, 1), major=(0.0, 0.0)):
    cells, levels = bake(image.astype(np.float32), wrap)
    S, fetched = np.zeros(SCRATCH, np.float32), np.zeros(LANES, np.uint64)
    n = len(u)
    footprint = ((MAJOR_U, major[0]), (MAJOR_V, major[1]), (MINOR_U, -major[1]), (MINOR_V, major[0]))
    for slot, values in ((U, u), (V, v), (TEXELS, texels), *footprint):
        S[slot : slot + n] = values
    one, zero = np.float32(1), np.float32(0)
    sample(S, n, cells, fetched, levels, one, zero, one, zero, wrap, *probes)
    return S[TEX : TEX + n]


@pytest.fixture
def image():
    return np.random.default_rng(0).uniform(0.05, 0.95, (32, 64))


def test_texel_centres_return_the_texels(image):
    u, v = (np.arange(50) + 0.5) / 64, np.full(50, 3.5 / 32)
    assert lookup(image, u, v, 0.5) == pytest.approx(image[3, :50], abs=2e-5)
    assert lookup(image, u + 2, v - 1, 0.5) == pytest.approx(image[3, :50], abs=1e-4)
    assert lookup(image, u, v, 0.5, wrap=False) == pytest.approx(image[3, :50], abs=2e-5)


def test_a_wide_footprint_returns_the_mean(image):
    u = np.random.default_rng(1).uniform(-3, 3, 60)
    assert lookup(image, u, u[::-1], 1000.0) == pytest.approx(image.mean(), abs=0.03)
    square = image[:, :32]
    assert lookup(square, u, u[::-1], 1000.0) == pytest.approx(square.mean(), abs=1e-4)


def test_the_border_continues_or_repeats(image):
    outside = np.full(2, -0.3 / 64)
    v = np.full(2, 3.5 / 32)
    assert lookup(image, outside, v, 0.5, wrap=False) == pytest.approx(image[3, 0], abs=2e-5)
    assert lookup(image, outside, v, 0.5) == pytest.approx(0.2 * image[3, 0] + 0.8 * image[3, -1], abs=0.3)


def test_continuous_in_place_and_footprint(image):
    steps = np.linspace(0, 1, LANES)
    moved = lookup(image, 0.3 + steps / 20, 0.2 + 0 * steps, 1.3)
    widened = lookup(image, 0.3 + 0 * steps, 0.2, 1 + 3 * steps)
    for values in (moved, widened):
        assert 0.05 < np.ptp(values) < 0.9
        assert np.abs(np.diff(values)).max() < 0.05


@pytest.mark.parametrize("footprint", [1.0, 1.5, 2.0, 3.0, 5.7])
def test_a_constant_stays_constant(footprint):
    grey = np.full((16, 16), 0.4)
    values = lookup(grey, np.linspace(-1, 1, 40), np.zeros(40), footprint, probes=(4, 1), major=(0.1, 0.2))
    assert values == pytest.approx(0.4, abs=2e-5)
