import numpy as np
import pytest

from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.rendering.camera import hand_camera
from evslip.rendering.dirt import Dirt, transmission

DIRTY = {"spots": 20.0, "spot_px": 6.0, "spot_opacity": 0.4}


def sample(index=0, **lens):
    changes = {f"lens.{key}": value for key, value in lens.items()}
    return draw(load_config("simple", {"camera.width": 138, "camera.height": 104, **changes}), index)


def through(params, size=None):
    found = transmission(params, hand_camera(params, size))
    assert found is not None
    return found


def test_spots_take_as_much_light_as_their_number_size_and_opacity_say():
    one = through(sample(spots=1.0, spot_px=4.0, spot_opacity=0.4, index=3))
    assert 0.2 < 1 - one.min() <= 0.4 and one.max() == 1 and one.dtype == np.float32
    lost = np.mean(
        [np.sum(1 - through(sample(index, spots=5.0, spot_px=2.0, spot_opacity=0.4))) for index in range(40)]
    )
    # Mean of (radius / spot_px)^2 over [0.5, 1.5] is 13/12, of the opacity 0.75 of the largest; what lies outside the
    # image is lost.
    assert lost == pytest.approx(5 * np.pi / np.log(2) * 4 * 13 / 12 * 0.75 * 0.4, rel=0.12)


def test_spots_are_each_samples_own_and_stay_where_they_are():
    first, again, other = through(sample(0, **DIRTY)), through(sample(0, **DIRTY)), through(sample(1, **DIRTY))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_spots_are_the_same_at_every_resolution():
    params = sample(**DIRTY)
    fine = through(params, (276, 208)).reshape(104, 2, 138, 2).mean((1, 3))
    assert np.abs(fine - through(params)).max() < 0.01


def test_glare_scatters_light_evenly_and_loses_none():
    params, image = sample(glare=0.2), np.random.default_rng(0).random((104, 138), np.float32)
    formed = image.copy()
    Dirt(params, hand_camera(params)).darken(formed)
    assert formed.mean() == pytest.approx(image.mean(), rel=1e-5)
    assert formed == pytest.approx(0.8 * image + 0.2 * image.mean(), rel=1e-5)


def test_a_clean_lens_changes_nothing():
    for params in (sample(), sample(spots=20.0, spot_opacity=0.0), sample(spots=0.3)):
        image = np.random.default_rng(0).random((104, 138), np.float32)
        formed = image.copy()
        Dirt(params, hand_camera(params)).darken(formed)
        assert np.array_equal(formed, image)
