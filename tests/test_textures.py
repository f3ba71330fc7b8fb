import numpy as np
import pytest
from PIL import Image

from evslip import textures
from evslip.errors import ConfigError
from evslip.patterns import SIZE, make


def test_pool_has_48_different_textures_with_photographic_contrast():
    names = textures.pool()
    assert len(set(names)) == 48
    means, contrasts, contents = [], [], set()
    for name in names:
        image = textures.load(name)
        assert image.shape == (SIZE, SIZE, 3)
        assert image.dtype == np.float32
        assert image.min() >= 0 and image.max() <= 1
        luma = image @ np.array([0.2126, 0.7152, 0.0722], np.float32)
        contents.add(image.tobytes())
        means.append(float(luma.mean()))
        contrasts.append(float(np.log(luma).std()))
    assert len(contents) == 48
    assert min(means) < 0.1 and max(means) > 0.5
    assert min(contrasts) > 0.1 and np.median(contrasts) > 0.3


@pytest.mark.parametrize("name", ["wood-1", "stone-2", "noise-0", "cardboard-3"])
def test_a_texture_is_the_same_every_time(name):
    family, number = name.rsplit("-", 1)
    assert np.array_equal(make(family, int(number)), textures.load(name))


@pytest.mark.parametrize("name", [name for name in textures.pool() if not name.startswith("cardboard")])
def test_textures_tile_without_a_seam(name):
    image = textures.load(name).mean(2)
    for axis in (0, 1):
        rolled = np.roll(image, SIZE // 2, axis)
        steps = np.abs(np.diff(rolled, axis=axis)).mean(1 - axis)
        assert steps[SIZE // 2 - 1] <= 1.05 * steps.max()
        assert steps[SIZE // 2 - 1] <= 4 * steps.mean() or name.startswith(("tile", "brick", "wood", "weave"))


def test_expand():
    assert textures.expand("wood-*") == tuple(f"wood-{i}" for i in range(6))
    assert textures.expand("*") == textures.pool()
    assert textures.expand("wood-1") == "wood-1"
    assert textures.expand(("a", "b")) == ("a", "b")
    with pytest.raises(ConfigError, match="wod"):
        textures.expand("wod-*")


def test_a_folder_of_photographs(tmp_path):
    for name, value in (("b.png", 255), ("a.jpg", 0), ("note.txt", None)):
        if value is None:
            (tmp_path / name).write_text("no image")
        else:
            Image.new("RGB", (64, 32), (value, value, value)).save(tmp_path / name)
    found = textures.expand(str(tmp_path / "*"))
    assert found == (str(tmp_path / "a.jpg"), str(tmp_path / "b.png"))
    assert textures.load(found[1]).mean() == pytest.approx(1.0)
    assert textures.load(found[0]).mean() == pytest.approx(0.0)


@pytest.mark.parametrize("content", [b"", b"not an image", b"\x89PNG\r\n\x1a\n truncated"])
def test_an_unreadable_image_is_named(tmp_path, content):
    path = tmp_path / "photo.png"
    path.write_bytes(content)
    with pytest.raises(ConfigError, match=r"photo\.png"):
        textures.load(str(path))
    with pytest.raises(ConfigError, match="nowhere"):
        textures.load(str(tmp_path / "nowhere.png"))


def test_srgb_round_trip():
    values = np.linspace(0, 1, 256)
    assert textures.linear_to_srgb(textures.srgb_to_linear(values)) == pytest.approx(values, abs=1e-6)
    assert textures.srgb_to_linear(np.array(0.5)) == pytest.approx(0.2140, abs=1e-4)
