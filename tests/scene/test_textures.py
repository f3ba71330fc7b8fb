import glob
import io
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from evslip.scene.textures import library, matching, patterns
from evslip.scene.textures.canvas import SIZE
from evslip.scene.textures.panoramas.panorama import COLUMNS, ROWS
from evslip.utils.errors import ConfigError

PHOTOGRAPHIC = ("wood", "stone", "brick", "cardboard", "paper", "metal", "ground", "noise", "tile")
WITH_EDGES = ("cardboard", "paper", "plastic-1", "plastic-5", "metal-7")
"""Things that end where the texture ends."""
LUMA = np.array([0.2126, 0.7152, 0.0722], np.float32)


@pytest.fixture(scope="module")
def lumas():
    """Luminance of every material."""
    return {name: library.load(name) @ LUMA for name in library.pool()}


def test_the_pool_is_large_and_every_texture_differs(lumas):
    assert len(library.pool()) >= 60
    assert len({luma.tobytes() for luma in lumas.values()}) == len(lumas) == len(set(library.pool()))
    assert all(luma.shape == (SIZE, SIZE) and luma.min() > 0.0099 and luma.max() < 0.951 for luma in lumas.values())
    means = [float(luma.mean()) for luma in lumas.values()]
    assert min(means) < 0.1 and max(means) > 0.6


def exponent(luma):
    """a of the amplitude spectrum 1 / f^a between 4 and 128 cycles a side, mean over the directions."""
    spectrum = np.abs(np.fft.fft2(luma - luma.mean()))
    frequency = np.hypot(np.fft.fftfreq(SIZE, 1 / SIZE)[:, None], np.fft.fftfreq(SIZE, 1 / SIZE))
    edges = np.geomspace(4, 128, 8)
    amplitude = [spectrum[(frequency >= a) & (frequency < b)].mean() for a, b in pairwise(edges)]
    return -np.polyfit(np.log(np.sqrt(edges[:-1] * edges[1:])), np.log(amplitude), 1)[0]


def test_textures_have_the_statistics_of_photographs(lumas):
    # Tolhurst, Tadmor and Chao 1992: natural images have exponents from 0.8 to 1.5, 1.2 on average.
    chosen = [luma for name, luma in lumas.items() if name.rpartition("-")[0] in PHOTOGRAPHIC]
    exponents = [exponent(luma) for luma in chosen]
    contrasts = [luma.std() / luma.mean() for luma in chosen]
    assert 0.95 < np.median(exponents) < 1.35
    assert min(exponents) > 0.6 and max(exponents) < 1.7
    assert 0.35 < np.median(contrasts) < 0.6
    assert min(contrasts) > 0.1


def test_the_statistics_would_notice_noise_and_blur():
    rng = np.random.default_rng(0)
    white = rng.random((SIZE, SIZE))
    assert abs(exponent(white)) < 0.1
    blurred = white
    for _ in range(60):
        blurred = (blurred + np.roll(blurred, 1, 0) + np.roll(blurred, 1, 1) + np.roll(blurred, (1, 1), (0, 1))) / 4
    assert exponent(blurred) > 1.5


@pytest.mark.parametrize("name", ["wood-2", "stone-2", "noise-0", "cardboard-3", "plastic-8", "paper-3", "ground-7"])
def test_a_texture_is_the_same_every_time(name):
    family, number = name.rsplit("-", 1)
    assert np.array_equal(patterns.make(family, int(number)), library.load(name))


def test_textures_tile_without_a_seam(lumas):
    """Across the seam, the step is no larger than the largest inside: a texture may have joints there, but no cut."""
    for name, luma in lumas.items():
        if name.startswith(WITH_EDGES):
            continue
        for axis in (0, 1):
            rolled = np.roll(luma, SIZE // 2, axis)
            steps = np.abs(np.diff(rolled, axis=axis)).mean(1 - axis)
            assert steps[SIZE // 2 - 1] <= 1.3 * steps.max(initial=0, where=np.arange(SIZE - 1) != SIZE // 2 - 1), name


@pytest.mark.parametrize("name", ["outdoors-0", "outdoors-4", "room-1"])
def test_a_panorama_goes_around_without_a_seam(name):
    image = library.load(name, is_background=True)
    assert image.shape == (ROWS, COLUMNS, 3) and library.is_panorama(image)
    luma = image[: ROWS // 2] @ LUMA
    steps = np.abs(np.diff(luma, axis=1, append=luma[:, :1])).mean(0)
    assert steps[-1] <= 1.5 * np.quantile(steps, 0.999)


def test_panoramas_are_for_backgrounds_alone():
    assert set(library.pool()) < set(library.pool(True))
    assert library.expand("outdoors-1", is_background=True) == "outdoors-1"
    with pytest.raises(ConfigError, match=r"'outdoors-1' is a panorama.*background\.texture"):
        library.expand("outdoors-1")
    with pytest.raises(ConfigError, match=r"room-\*"):
        library.expand("room-*")


def test_expand():
    assert library.expand("wood-*") == tuple(f"wood-{i}" for i in range(len(patterns.FAMILIES["wood"])))
    assert library.expand("*") == library.pool()
    assert library.expand("*", is_background=True) == library.pool(True)
    assert library.expand("wood-1") == "wood-1"
    assert library.expand(("wood-1", "tile-*")) == (
        "wood-1",
        *(f"tile-{i}" for i in range(len(patterns.FAMILIES["tile"]))),
    )
    for wrong in ("wod-*", "wood-99", "nowhere/", "nowhere/*.png"):
        with pytest.raises(ConfigError, match=wrong.replace("*", r"\*")):
            library.expand(wrong)


def test_a_name_of_any_length_is_no_more_than_wrong():
    for name in ("x" * 300, "x" * 1_000_000, "*" * 5000, "~nobody at all/x.png", "\0"):
        with pytest.raises(ConfigError, match="texture") as caught:
            library.expand(name)
        assert len(str(caught.value)) < 1000


def test_a_folder_of_images(tmp_path):
    for name, value in (("b.png", 255), ("a.jpg", 0), ("note.txt", None)):
        if value is None:
            (tmp_path / name).write_text("no image")
        else:
            Image.new("RGB", (64, 32), (value, value, value)).save(tmp_path / name)
    wanted = (str(tmp_path / "a.jpg"), str(tmp_path / "b.png"))
    assert library.expand(str(tmp_path)) == library.expand(str(tmp_path / "*")) == wanted
    assert library.load(wanted[1]).mean() == pytest.approx(1.0)
    assert library.load(wanted[0]).mean() == pytest.approx(0.0)
    (tmp_path / "empty").mkdir()
    with pytest.raises(ConfigError, match=r"empty.*matches no image file"):
        library.expand(str(tmp_path / "empty"))


def test_patterns_find_what_glob_finds_among_so_many_files(tmp_path, monkeypatch):
    for name in ("a/b/c.png", "a/.h/x.png", "a/d.png", ".hid.png", "e.jpg", "a/b/e/f.png", "x[1]/y.png", "a/n.txt"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    monkeypatch.chdir(tmp_path)
    for pattern in ("*", "**", "**/*.png", "a/**/*.png", "*/*", "**/b/*", ".*", "a/.h/*", "x[[]1]/*", "[ae]*", "b/*"):
        for start in ("", f"{tmp_path}/"):
            found = glob.glob(start + pattern, recursive=True)  # noqa: PTH207
            expected = {str(Path(path)) for path in found if path != start}
            assert set(matching.matching_files(start + pattern)) == expected, pattern
    monkeypatch.setattr(matching, "MOST_ENTRIES", 5)
    for pattern in ("**/**", "**/*.png", f"{tmp_path}/**"):
        with pytest.raises(ConfigError, match="more than 5 files and folders to look through"):
            library.expand(pattern)


def test_an_image_is_scaled_in_linear_light(tmp_path):
    """Halves of black and white, finer than a texel: their mean is 0.5 of the light, not sRGB 0.5."""
    board = np.indices((2 * SIZE, 2 * SIZE)).sum(0) % 2 * 255
    Image.fromarray(board.astype(np.uint8)).save(tmp_path / "board.png")
    inner = library.load(str(tmp_path / "board.png"))[8:-8, 8:-8]
    assert inner == pytest.approx(0.5, abs=0.01)


def encoded(mode, path):
    """A picture whose left half is mid-grey (sRGB 0.5) and whose right half is white, in some pixel format."""
    grey = np.full((40, 80), 128, np.uint8)
    grey[:, 40:] = 255
    if mode == "I;16":
        Image.fromarray(np.where(grey == 128, 32896, 65535).astype(np.uint16)).save(path)
    elif mode == "clear":  # the right half is black, but transparent: it counts as white paper
        rgba = np.zeros((40, 80, 4), np.uint8)
        rgba[:, :40] = (128, 128, 128, 255)
        Image.fromarray(rgba).save(path)
    else:
        Image.fromarray(grey).convert(mode).save(path)


@pytest.mark.parametrize(
    ("mode", "suffix"),
    [("L", "png"), ("RGB", "webp"), ("P", "png"), ("CMYK", "jpg"), ("I;16", "png"), ("I;16", "tif"), ("clear", "png")],
)
def test_pixel_formats(mode, suffix, tmp_path):
    path = tmp_path / f"half.{suffix}"
    encoded(mode, path)
    image = library.load(str(path))
    assert image.shape == (SIZE, SIZE, 3) and image.dtype == np.float32
    assert image[:, : SIZE // 3] == pytest.approx(0.2158, abs=0.01)  # (128 / 255) decoded
    assert image[:, -SIZE // 3 :] == pytest.approx(1.0, abs=0.01)


def test_a_turned_photograph_stands_upright(tmp_path):
    picture = Image.fromarray(np.repeat(np.array([[0, 255]], np.uint8), 60, 0).repeat(30, 1))
    exif = Image.Exif()
    exif[0x0112] = 6  # to be turned by a quarter clockwise: the left side comes to the top
    picture.save(tmp_path / "turned.jpg", exif=exif, quality=95)
    image = library.load(str(tmp_path / "turned.jpg"))
    assert image[: SIZE // 3].max() < 0.05 and image[-SIZE // 3 :].min() > 0.9


def test_an_image_twice_as_wide_as_high_is_a_panorama_behind_and_a_texture_elsewhere(tmp_path):
    ramp = np.repeat(np.linspace(0, 255, 64).astype(np.uint8)[:, None], 128, 1)
    Image.fromarray(ramp).save(tmp_path / "sphere.png")
    name = str(tmp_path / "sphere.png")
    assert library.load(name).shape == (SIZE, SIZE, 3)
    around = library.load(name, is_background=True)
    assert around.shape == (ROWS, COLUMNS, 3)
    assert np.all(np.diff(around[:, 5, 0]) >= 0)


def broken(kind):
    buffer = io.BytesIO()
    Image.fromarray(np.random.default_rng(0).integers(0, 255, (64, 64, 3), np.uint8)).save(buffer, "PNG")
    whole = buffer.getvalue()
    return {"empty": b"", "text": b"not an image", "header": whole[:20], "cut": whole[: len(whole) // 2]}[kind]


@pytest.mark.parametrize("kind", ["empty", "text", "header", "cut"])
def test_a_broken_image_is_named(kind, tmp_path):
    path = tmp_path / "photo.png"
    path.write_bytes(broken(kind))
    for is_background in (False, True):
        with pytest.raises(ConfigError, match=r"photo\.png: cannot be read as an image") as caught:
            library.load(str(path), is_background)
        assert "\n" not in str(caught.value)


def test_images_that_cannot_be_used_say_why(tmp_path, monkeypatch):
    Image.fromarray(np.zeros((4, 4), np.float32)).save(tmp_path / "float.tif")
    with pytest.raises(ConfigError, match=r"float\.tif.*8 or 16 bits"):
        library.load(str(tmp_path / "float.tif"))
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 1000)
    Image.new("L", (40, 40)).save(tmp_path / "huge.png")  # beyond a warning
    Image.new("L", (400, 40)).save(tmp_path / "vast.png")  # beyond an error
    for name in ("huge.png", "vast.png"):
        with pytest.raises(ConfigError, match=rf"{name}.*million pixels"):
            library.load(str(tmp_path / name))


def test_srgb_round_trip():
    values = np.linspace(0, 1, 256)
    assert library.linear_to_srgb(library.srgb_to_linear(values)) == pytest.approx(values, abs=1e-6)
    assert library.srgb_to_linear(np.array(0.5)) == pytest.approx(0.2140, abs=1e-4)


def test_an_image_that_was_edited_is_read_again(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    for size, is_background in (((8, 8), False), ((8, 4), True)):
        Image.new("L", size, 0).save(tmp_path / "own.bmp")
        before = library.load("~/own.bmp", is_background)
        assert library.load("~/own.bmp", is_background) is before and not before.any()
        Image.new("L", (2 * size[0], 2 * size[1]), 255).save(tmp_path / "own.bmp")
        assert library.load("~/own.bmp", is_background).min() == 1.0
