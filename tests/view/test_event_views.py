"""The preview video and the plot of the rates."""

import av
import numpy as np
import pytest

from evslip.events import Events
from evslip.events.overlay import OFF_COLOR, ON_COLOR
from evslip.events.stream import SHOT, SIGNAL
from evslip.utils.errors import ConfigError
from evslip.view.pictures.preview import Accumulator, check_preview, preview
from evslip.view.pictures.rates import Rates, check_plot

SIZE = (31, 21)


def events(t_us: list[int], x: int, y: int, on: bool, cause: int = SIGNAL) -> Events:
    n = len(t_us)
    places = np.full(n, x, np.uint16), np.full(n, y, np.uint16)
    return Events(np.array(t_us), *places, np.full(n, on), None, np.full(n, cause, np.uint8))


def pictures(path) -> list[np.ndarray]:
    with av.open(str(path)) as container:
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]


@pytest.mark.parametrize("pieces", [1, 100])
def test_each_picture_shows_the_events_of_its_time(pieces, tmp_path):
    times = [[1000, 1001, 1002, 1003], [11_500] * 4, [41_000] * 4]
    parts = [events(times[0], 5, 5, True), events(times[1], 20, 10, False), events(times[2], 5, 5, False)]
    path = tmp_path / "p.mp4"
    with preview(path, SIZE, 1000.0, 10.0) as drawn:
        for part in parts:
            for start in range(0, 4, pieces):
                drawn(part.select(slice(start, start + pieces)), 0.0)
    shown = pictures(path)
    scale = 16
    assert len(shown) == 5
    assert shown[0].shape == (21 * scale, 31 * scale, 3)

    def at(picture: int, x: int, y: int) -> np.ndarray:
        block = shown[picture][y * scale : (y + 1) * scale, x * scale : (x + 1) * scale]
        return block[5:-5, 5:-5].mean((0, 1))

    for picture, x, y, color in ((0, 5, 5, ON_COLOR), (1, 20, 10, OFF_COLOR), (4, 5, 5, OFF_COLOR)):
        np.testing.assert_allclose(at(picture, x, y), 255 + (1 - 0.5**4) * (np.array(color) - 255), atol=14)
    for picture, x, y in ((0, 20, 10), (1, 5, 5), (2, 5, 5), (3, 20, 10)):
        np.testing.assert_allclose(at(picture, x, y), 255, atol=6)


def test_more_events_are_stronger_and_both_polarities_mix():
    drawn = Accumulator(lambda picture: None, SIZE, 1, 0.0, 10_000.0)
    drawn.push(events([1], 1, 1, True))
    drawn.push(events([2, 3, 4], 2, 1, True))
    drawn.push(events([5], 3, 1, True))
    drawn.push(events([6], 3, 1, False))
    picture = drawn.picture()
    assert picture.shape == (21, 31, 3)
    np.testing.assert_allclose(picture[1, 1], (np.array(ON_COLOR) + 255) / 2, atol=1)
    assert picture[1, 2, 1] < picture[1, 1, 1]
    middle = (np.array(ON_COLOR) + np.array(OFF_COLOR)) / 2
    np.testing.assert_allclose(picture[1, 3], 255 + 0.75 * (middle - 255), atol=1)
    assert (picture[0] == 255).all()


def test_a_silent_stream_has_a_picture_and_an_error_leaves_no_video(tmp_path):
    with preview(tmp_path / "p.mp4", SIZE, 0.0, 10.0):
        pass
    assert len(pictures(tmp_path / "p.mp4")) == 1
    with pytest.raises(RuntimeError, match="stop"), preview(tmp_path / "q.mkv", SIZE, 0.0, 10.0) as drawn:
        drawn(events([1], 1, 1, True), 2.0)
        raise RuntimeError("stop")
    assert [path.name for path in tmp_path.iterdir()] == ["p.mp4"]


def test_rates_are_counts_over_time():
    rates = Rates(0.0)
    rates.push(events(list(range(0, 10_000, 100)), 1, 1, True))
    rates.push(events(list(range(10_000, 20_000, 50)), 1, 1, False))
    rates.push(events([20_100], 1, 1, False, SHOT), 20_500.0)
    t_s, (on, off, noise) = rates.per_second()
    assert len(t_s) == 21
    np.testing.assert_allclose(t_s[:2], [0.0005, 0.0015])
    np.testing.assert_allclose(on, [1e4] * 10 + [0] * 11)
    # The last bin lasts half a millisecond.
    np.testing.assert_allclose(off, [0] * 10 + [2e4] * 10 + [2000])
    np.testing.assert_allclose(noise, [0] * 20 + [2000])


def test_rates_of_long_streams_stay_small_and_lose_no_event():
    rates = Rates(5.0)
    for start in range(0, 3_600_000_000, 60_000_000):
        rates.push(events([start + 10, start + 30_000_000], 1, 1, True), start + 60_000_000)
    t_s, (on, _, _) = rates.per_second()
    assert len(t_s) <= 2048
    assert (on * np.diff(np.append(t_s - rates.bin_us / 2e6, 3600))).sum() == pytest.approx(120, rel=1e-3)


def test_a_stream_may_end_in_silence():
    rates = Rates(0.0)
    rates.push(events([1000, 2000], 1, 1, True), 1e7)
    t_s, (on, _, _) = rates.per_second()
    assert len(t_s) <= 2048 and t_s[-1] > 9.9 and (on > 0).sum() == 1


def test_a_plot_is_a_png():
    rates = Rates(0.0)
    assert rates.png("nothing").startswith(b"\x89PNG")
    rates.push(events([5, 50_000], 1, 1, True))
    assert rates.png("two") == rates.png("two")


def test_names_and_times_that_cannot_be_meant(tmp_path):
    with pytest.raises(ConfigError, match=r"p\.png.*\.mp4"):
        check_preview(tmp_path / "p.png", 10)
    for picture_ms in (0, -1, float("nan")):
        with pytest.raises(ConfigError, match="preview-ms"):
            check_preview(tmp_path / "p.mp4", picture_ms)
    with pytest.raises(ConfigError, match=r"p\.mp4.*\.png"):
        check_plot(tmp_path / "p.mp4")
