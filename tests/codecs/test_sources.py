import av
import numpy as np
import pytest
from PIL import Image

from evslip.codecs.clips import frames_from
from evslip.codecs.clips.sources import open_clip
from evslip.events import EventCamera
from evslip.utils.errors import ConfigError, DataError
from shared_data import shared


def save(path, value: int, size=(12, 8)) -> None:
    Image.fromarray(np.full(size[::-1], value, np.uint8)).save(path)


def test_images_come_in_natural_order_at_their_times(tmp_path):
    for number in (10, 9, 100, 1):
        save(tmp_path / f"frame_{number}.png", number)
    (tmp_path / "notes.txt").write_text("not an image")
    frames = list(frames_from(tmp_path, 40.0))
    assert [t_us for t_us, _ in frames] == [0, 25_000, 50_000, 75_000]
    assert [image[0, 0] for _, image in frames] == [1, 9, 10, 100]
    assert all(image.shape == (8, 12) and image.dtype == np.uint8 for _, image in frames)
    assert open_clip(tmp_path, 1.0).size == (12, 8)


def test_colours_and_deep_greys_become_bytes(tmp_path):
    Image.fromarray(np.full((8, 12, 3), 200, np.uint8)).save(tmp_path / "a.png")
    Image.fromarray(np.full((8, 12), 200 * 257, np.uint16)).save(tmp_path / "b.png")
    assert [int(image[0, 0]) for _, image in frames_from(tmp_path, 1.0)] == [200, 200]


def test_folders_that_cannot_be_meant(tmp_path):
    with pytest.raises(DataError, match="holds no images"):
        frames_from(tmp_path, 10.0)
    with pytest.raises(DataError, match="no such"):
        frames_from(tmp_path / "nowhere", 10.0)
    save(tmp_path / "a.png", 1)
    with pytest.raises(ConfigError, match="fps"):
        frames_from(tmp_path)
    for fps in (0, -1.0, float("nan")):
        with pytest.raises(ConfigError, match="fps"):
            frames_from(tmp_path, fps)
    save(tmp_path / "b.png", 1, (12, 9))
    with pytest.raises(DataError, match=r"b\.png: is 12x9 pixels.*12x8"):
        list(frames_from(tmp_path, 10.0))


@pytest.mark.parametrize("content", [b"", b"this is text", None])
def test_an_unreadable_image_is_named(tmp_path, content):
    rng = np.random.default_rng(0)
    whole = tmp_path / "whole.png"
    Image.fromarray(rng.integers(0, 255, (64, 64), np.uint8)).save(whole)
    (tmp_path / "bad.png").write_bytes(whole.read_bytes()[:2000] if content is None else content)
    with pytest.raises(DataError, match=r"bad\.png") as caught:
        list(frames_from(tmp_path, 10.0))
    assert "\n" not in str(caught.value)


@pytest.fixture
def video(tmp_path):
    path = tmp_path / "clip.mp4"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("mpeg4", rate=50)
        stream.width, stream.height, stream.pix_fmt = 32, 16, "yuv420p"
        for value in range(0, 200, 20):
            picture = np.full((16, 32, 3), value, np.uint8)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode())
    return path


def test_a_video_brings_its_own_times(video):
    frames = list(frames_from(video))
    np.testing.assert_allclose([t_us for t_us, _ in frames], np.arange(10) * 20_000, atol=1)
    assert frames[0][1].shape == (16, 32)
    assert np.all(np.diff([int(image[8, 8]) for _, image in frames]) > 5)
    np.testing.assert_allclose([t_us for t_us, _ in frames_from(video, 500)], np.arange(10) * 2000, atol=1)
    assert open_clip(video).size == (32, 16)


def test_an_unreadable_video_is_named(tmp_path):
    path = tmp_path / "bad.mp4"
    path.write_bytes(b"not a video at all" * 100)
    with pytest.raises(DataError, match=r"bad\.mp4"):
        list(frames_from(path))


def test_real_frames_give_a_plausible_stream():
    folder = shared("real", "slider_depth")
    size = open_clip(folder, 1.0).size
    assert size == (240, 180)
    events = EventCamera("davis346", size=size, intensity="uint8").run(frames_from(folder, 86 / 3.33))
    # A slide past textured planes: every edge darkens and brightens pixels in turn.
    assert 2e5 < events.count < 5e6
    assert 0.3 < events.p.mean() < 0.7
    assert events.t_us[-1] == pytest.approx(3.33e6, abs=2e4)
