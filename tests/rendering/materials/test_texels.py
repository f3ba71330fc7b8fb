import numpy as np
import pytest

from evslip.rendering.materials.texels import SQUARE, TRIANGLE, bake, sample_along, sample_around, squared
from evslip.rendering.slots import MAJOR_U, MAJOR_V, MINOR_U, MINOR_V, SCRATCH, SLOT, TEX, U, V

AROUND = {"square": SQUARE, "triangle": TRIANGLE}


def lookup(image, u, v, side, wrap=True, probes="square", length: float | np.ndarray = 1.0, angle=0.0):
    """side: of the footprint, in texels along u; length: of its longer side, at `angle` to u, in sides."""
    cells, levels = bake(image.astype(np.float32), wrap)
    S, loaded = np.zeros(SCRATCH, np.float32), np.zeros(SLOT, np.uint64)
    n, (rows, columns) = len(u), image.shape
    along, across = (length * np.cos(angle), length * np.sin(angle)), (-np.sin(angle), np.cos(angle))
    values = (u, v, *(side * w[k] / (columns, rows)[k] for w in (along, across) for k in range(2)))
    for slot, value in zip((U, V, MAJOR_U, MAJOR_V, MINOR_U, MINOR_V), values, strict=True):
        S[slot : slot + n] = value
    if probes == "row":
        sample_along(S, n, cells, loaded, levels)
    else:
        sample_around(S, n, cells, loaded, levels, wrap, AROUND[probes])
    return S[TEX : TEX + n]


@pytest.fixture
def image():
    return np.random.default_rng(0).uniform(0.05, 0.95, (32, 64))


def test_texel_centres_return_the_texels(image):
    u, v = (np.arange(50) + 0.5) / 64, np.full(50, 3.5 / 32)
    assert lookup(image, u, v, 1e-4) == pytest.approx(image[3, :50], abs=2e-5)
    assert lookup(image, u + 2, v - 1, 1e-4) == pytest.approx(image[3, :50], abs=1e-4)
    assert lookup(image, u, v, 1e-4, wrap=False) == pytest.approx(image[3, :50], abs=2e-5)


def test_a_wide_footprint_returns_the_mean(image):
    u = np.random.default_rng(1).uniform(-3, 3, 60)
    assert lookup(image, u, u[::-1], 1000.0) == pytest.approx(image.mean(), abs=0.03)
    square = image[:, :32]
    assert lookup(square, u, u[::-1], 1000.0) == pytest.approx(square.mean(), abs=1e-4)


def test_the_border_continues_or_repeats(image):
    outside = np.full(2, -0.3 / 64)
    v = np.full(2, 3.5 / 32)
    assert lookup(image, outside, v, 1e-4, wrap=False) == pytest.approx(image[3, 0], abs=2e-5)
    assert lookup(image, outside, v, 1e-4) == pytest.approx(0.2 * image[3, 0] + 0.8 * image[3, -1], abs=0.3)


def test_continuous_in_place_and_footprint(image):
    steps = np.linspace(0, 1, SLOT)
    moved = lookup(image, 0.3 + steps / 20, 0.2 + 0 * steps, 1.3)
    widened = lookup(image, 0.3 + 0 * steps, 0.2, 1 + 3 * steps)
    lengthened = lookup(image, 0.3 + 0 * steps, 0.2, 1.3, probes="row", length=1 + 4 * steps, angle=0.4)
    for values in (moved, widened, lengthened):
        assert 0.05 < np.ptp(values) < 0.9
        assert np.abs(np.diff(values)).max() < 0.05


@pytest.mark.parametrize("probes", ["square", "triangle", "row"])
@pytest.mark.parametrize("side", [0.01, 1.0, 1.5, 2.0, 3.0, 5.7])
def test_a_constant_stays_constant(probes, side):
    grey = np.full((16, 16), 0.4)
    values = lookup(grey, np.linspace(-1, 1, 40), np.zeros(40), side, probes=probes, length=4.3, angle=0.7)
    assert values == pytest.approx(0.4, abs=2e-5)


@pytest.mark.parametrize(
    ("probes", "length"), [("square", 1.0), ("square", 1.15), ("triangle", 1.0), ("row", 2.0), ("row", 4.9)]
)
@pytest.mark.parametrize("side", [0.3, 1.0, 2.3, 4.1, 7.7])
@pytest.mark.parametrize("angle", [0.0, 0.5])
def test_a_texture_is_blurred_as_much_as_by_the_footprint(probes, length, side, angle):
    # A texture of x^2 exceeds x^2 where it is looked up by the variance of the lookup, on average over the places. Of a
    # mean over the footprint that is side^2 / 12, and 1/6 more since texels are joined linearly.
    rng = np.random.default_rng(0)
    u, v = 64 + rng.uniform(-8, 8, (2, 2048))
    x, y = np.meshgrid(np.arange(128) + 0.5 - 64, np.arange(128) + 0.5 - 64)

    def spread(direction):
        ramp, place = direction[0] * x + direction[1] * y, direction[0] * (u - 64) + direction[1] * (v - 64)
        means = []
        for image, largest in ((0.5 + ramp / 256, 256), ((ramp / 128) ** 2, 128**2)):
            chunks = [slice(k, k + SLOT) for k in range(0, len(u), SLOT)]
            found = [lookup(image, u[c] / 128, v[c] / 128, side, True, probes, length, angle) for c in chunks]
            means.append(np.concatenate(found) * largest)
        return np.mean(means[0] - 128 - place), np.mean(means[1] - place**2)

    for direction, width in (((np.cos(angle), np.sin(angle)), length), ((-np.sin(angle), np.cos(angle)), 1.0)):
        shift, variance = spread(direction)
        assert shift == pytest.approx(0, abs=0.05)
        expected = (width * side) ** 2 / 12 + 1 / 6
        if probes == "row" and width == 1.0:  # across, a row is as wide as a level: they are a factor of two apart
            assert 0.8 * 4 * variance / 3 < 4 * expected + 1 / 3
        else:
            assert variance == pytest.approx(expected, rel=0.06, abs=0.02)


@pytest.mark.parametrize(("ratio", "shape"), [(2.0, (32, 64)), (1.4, (32, 32)), (8.0, (8, 64)), (0.5, (32, 16))])
def test_texels_are_square_where_they_lie(image, ratio, shape):
    narrow = squared(image, ratio)
    assert narrow.shape == shape
    assert narrow.mean() == pytest.approx(image.mean())
    assert 0.7 <= ratio * shape[0] / shape[1] <= 1.42
