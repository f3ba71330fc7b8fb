import numpy as np
import pytest

from evslip.scene.textures.canvas import SIZE, U, V, fraction, step, wave
from evslip.scene.textures.lettering import STROKES, fit, length, write
from evslip.scene.textures.noise import cells, fractal, refine


def test_refining_keeps_constants_and_the_mean():
    rng = np.random.default_rng(0)
    values = rng.random((4, 8), np.float32)
    fine = refine(values, 16, 8)
    assert fine.shape == (8, 16)
    assert fine.mean() == pytest.approx(values.mean(), abs=1e-6)
    assert np.all(refine(np.full((4, 8), np.float32(0.3)), 16, 8) == np.float32(0.3))


@pytest.mark.parametrize("gain", [0.5, 0.7, 1.0])
def test_noise_has_the_promised_mean_and_spread(gain):
    field = fractal(np.random.default_rng(1), 16, 16, 6, gain)
    assert field.shape == (SIZE, SIZE) and field.dtype == np.float32
    assert field.mean() == pytest.approx(0.5, abs=0.03)
    assert 0.1 < field.std() < 0.3
    assert ((field > 0) & (field < 1)).mean() > 0.9


def test_cells_equal_a_search_over_all_points():
    """Against brute force: the points' places are drawn in the same order."""
    across = 6
    near, second, _ = cells(np.random.default_rng(2), across)
    rng = np.random.default_rng(2)
    x = rng.random((across, across), np.float32) + np.arange(across)
    y = rng.random((across, across), np.float32) + np.arange(across)[:, None]
    for row, column in np.random.default_rng(3).integers(0, SIZE, (50, 2)):
        dx = np.abs(x - U[row, column] * across)
        dy = np.abs(y - V[row, column] * across)
        away = np.sort(np.hypot(np.minimum(dx, across - dx), np.minimum(dy, across - dy)).ravel())
        assert near[row, column] == pytest.approx(away[0], abs=1e-4)
        # Only the 3 x 3 cells around are searched, which hold the nearest point but not always the second.
        assert second[row, column] >= away[1] - 1e-4


def test_waves_and_steps():
    x = np.linspace(-2, 2, 401)
    assert wave(np.array([0.0, 0.5, 1.0, -0.5])) == pytest.approx([0, 1, 0, 1])
    assert np.all((fraction(x) >= 0) & (fraction(x) < 1))
    assert step(0, 1, np.array([-1.0, 0.5, 2.0])) == pytest.approx([0, 0.5, 1])
    assert step(1, 0, np.array([-1.0, 0.5, 2.0])) == pytest.approx([1, 0.5, 0])


def test_every_letter_leaves_ink_inside_its_place():
    for letter in STROKES:
        ink = np.zeros((80, 120), np.float32)
        end = write(ink, letter, 20, 20, 30)
        assert ink.max() > 0.9, letter
        assert end == pytest.approx(20 + length(letter, 30))
        assert ink[:, :16].max() == 0 and ink[:, round(end) + 4 :].max() == 0, letter


def test_words_that_do_not_fit_are_cut_off_and_fitted_ones_are_not():
    ink = np.zeros((40, 60), np.float32)
    write(ink, "WIDE WORDS", -30, -10, 30)
    assert ink.shape == (40, 60) and ink.max() > 0.9
    assert length("WIDE WORDS", fit("WIDE WORDS", 50, 30)) <= 50 + 1e-6
