"""Frames brought along optical flow, against scenes whose frames at any time are known."""

import sys

import numpy as np
import pytest

from evslip.codecs.clips import flow
from evslip.events import EventCamera
from evslip.utils.errors import ConfigError, MissingExtraError

cv2 = pytest.importorskip("cv2")
SHAPE = (96, 128)
INSIDE = np.s_[12:-12, 20:-20]


def texture(shift: float, rise: float = 0.0) -> np.ndarray:
    """Sum of 40 plane waves, moved right and down: light, float64 of SHAPE."""
    rng = np.random.default_rng(3)
    waves, phases = rng.normal(0, 0.35, (40, 2)), rng.uniform(0, 2 * np.pi, 40)
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    total = sum(np.sin(a * (x - shift) + b * (y - rise) + p) for (a, b), p in zip(waves, phases, strict=True))
    return np.clip(np.exp(-1.2 + 0.16 * total), 0, 1)


def disc(shift: float) -> np.ndarray:
    """A textured disc that moves right over a still ground of other texture."""
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    cover = np.clip(24.5 - np.hypot(x - 50 - shift, y - 48), 0, 1)
    return cover * texture(shift) + (1 - cover) * texture(31, 17)


def errors(scene, motion: float, share: float, intensity: flow.Intensity = "linear") -> tuple[float, float]:
    """Mean error of the log of the frame at a share of the interval: brought along flow, and of even change."""
    scale = 1.0 if intensity == "linear" else 255.0
    first, second = (scale * scene(way).astype(np.float32) for way in (0, motion))
    (made,) = flow.moved(first, second, (share,), intensity)
    assert (made.dtype, made.shape) == (np.float32, SHAPE)
    truth, even = np.log(scale * scene(motion * share)), (1 - share) * np.log(first) + share * np.log(second)
    return tuple(float(np.abs(guess - truth)[INSIDE].mean()) for guess in (np.log(made), even))


@pytest.mark.parametrize("intensity", ["linear", "uint8", "srgb"])
@pytest.mark.parametrize("share", [0.2, 0.5, 0.75])
def test_a_texture_that_moves_by_four_pixels_is_reproduced(share, intensity):
    error, even = errors(texture, 4.0, share, intensity)
    assert even > 0.08
    assert error < (0.1 if intensity == "linear" else 0.15) * even


@pytest.mark.parametrize("share", [0.25, 0.5])
def test_what_one_frame_alone_shows_comes_from_it(share):
    error, even = errors(disc, 6.0, share)
    assert error < 0.35 * even


def test_the_given_frames_stand_at_the_ends():
    first, second = (texture(way).astype(np.float32) for way in (0, 3))
    made = list(flow.moved(first, second, (0.0, 1.0)))
    np.testing.assert_allclose(made[0], first, atol=1e-6)
    np.testing.assert_allclose(made[1], second, atol=1e-6)


@pytest.mark.parametrize("intensity", ["linear", "uint8", "srgb"])
def test_where_nothing_moves_the_events_are_those_of_even_change(intensity):
    """A still scene that the light fades on: flow adds frames, not events."""
    white = 1.0 if intensity == "linear" else 255.0
    light = np.linspace(0.1, 0.9, SHAPE[1])[None].repeat(SHAPE[0], 0)
    frames = [(1e4 * n, (white * light * gain).astype(np.float32), None) for n, gain in enumerate((1.0, 0.5))]
    counts = []
    for way in (frames, flow.smoothed(frames, 8, intensity)):
        camera = EventCamera("clean", size=SHAPE[::-1], sigma=0.0, intensity=intensity)
        counts.append(camera.run(way).count)
    assert counts[0] > 20_000
    assert counts[1] == pytest.approx(counts[0], rel=0.02)


def test_frames_stand_evenly_with_the_bodies_of_the_nearer_one():
    images = [texture(way).astype(np.float32) for way in (0, 2)]
    bodies = [np.full(SHAPE, number, np.uint8) for number in range(3)]
    given = list(zip((0.0, 900.0, 1900.0), [*images, images[1]], bodies, strict=True))
    made = list(flow.smoothed(given, 3, "linear"))
    assert [t for t, _, _ in made] == [0, 300, 600, 900, 1900]  # nothing is put between two equal frames
    assert [int(mask[0, 0]) for _, _, mask in made if mask is not None] == [0, 0, 1, 1, 2]


def test_threads_of_the_library_change_nothing_and_are_left_as_they_are():
    first, second = (texture(way, way / 2).astype(np.float32) for way in (0, 5))
    before, results = cv2.getNumThreads(), []
    try:
        for threads in (1, 4):
            cv2.setNumThreads(threads)
            (made,) = flow.moved(first, second, (0.3,))
            assert cv2.getNumThreads() == threads
            results.append(made)
    finally:
        cv2.setNumThreads(before)
    np.testing.assert_array_equal(*results)


@pytest.mark.parametrize("shape", [(1, 1), (3, 40), (12, 12), (13, 17)])
def test_small_frames_are_blended(shape):
    first, second = np.full(shape, 0.2, np.float32), np.full(shape, 0.8, np.float32)
    (made,) = flow.moved(first, second, (0.5,))
    np.testing.assert_allclose(made, np.sqrt(0.201 * 0.801) - 0.001, rtol=1e-4)


@pytest.mark.parametrize("upsample", [1, 65])
def test_the_number_of_intervals_is_limited(upsample):
    with pytest.raises(ConfigError, match="expected 2 to 64"):
        flow.smoothed([], upsample, "linear")


def test_without_the_library_the_remedy_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "cv2", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'evslip\[flow\]'"):
        flow.smoothed([], 8, "linear")
