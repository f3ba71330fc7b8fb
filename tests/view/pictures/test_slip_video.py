from pathlib import Path

import numpy as np
import pytest

from evslip.data.record import Record
from evslip.events.overlay import OFF_COLOR, ON_COLOR
from evslip.events.stream import Events, empty_events
from evslip.utils.errors import ConfigError, DataError
from evslip.view.pictures.slip_video import CAPTION, STRIP, Film, FilmSettings
from evslip.view.pictures.video import FPS
from sample_records import random_events, simulated


def recording(events: Events, size: tuple[int, int] = (40, 30)) -> Record:
    return Record(kind="recording", name="r", size=size, events=events)


def test_pictures_show_the_events_of_their_window():
    # At 1 s on, at 1.5 s off, both far from the clock's zero.
    origin = 10**15
    events = Events(
        origin + np.array([0, 1_000_000, 1_500_000, 2_000_000]),
        np.array([0, 5, 6, 0], np.uint16),
        np.array([0, 7, 8, 0], np.uint16),
        np.array([True, True, False, True]),
    )
    film = Film([recording(events)], FilmSettings(window_ms=100, speed=1.0))
    assert film.times_us[0] == 0
    assert len(film) == pytest.approx(2 * FPS, abs=1)
    for t_us, pixel, color in ((1_050_000, (5, 7), ON_COLOR), (1_550_000, (6, 8), OFF_COLOR), (1_300_000, None, None)):
        picture = film.picture(t_us)
        stage = picture[CAPTION:-STRIP]
        scale = stage.shape[1] // 40
        assert stage.shape == (30 * scale, 40 * scale, 3)
        small = stage[::scale, ::scale]
        painted = {(int(x), int(y)) for y, x in np.argwhere((small != small[20, 20]).any(-1))}
        assert painted == (set() if pixel is None else {pixel})
        if pixel is not None:
            assert tuple(small[pixel[1], pixel[0]]) == color


def test_the_playhead_runs_from_side_to_side():
    film = Film([recording(random_events(np.random.default_rng(0), 200))], FilmSettings(speed=0.01))
    first, last = (film.picture(int(t))[-STRIP:] for t in film.times_us[[0, -1]])
    red = [np.flatnonzero((strip[STRIP // 2] == (200, 30, 30)).all(-1)) for strip in (first, last)]
    assert red[0].max() < red[1].min()
    assert first.shape[1] - red[1].max() < 30


def test_records_of_unlike_size_stand_side_by_side(tmp_path: Path):
    import av

    rng = np.random.default_rng(0)
    records = [recording(random_events(rng, 99)), recording(random_events(rng, 99, (500, 21)), (500, 21))]
    film = Film(records, FilmSettings(speed=0.2))
    film.write(tmp_path / "v.mp4")
    with av.open(tmp_path / "v.mp4") as container:
        frames = list(container.decode(video=0))
    assert len(frames) == len(film)
    height, width = film.picture(0).shape[:2]
    assert (frames[0].height, frames[0].width) == (height + height % 2, width + width % 2)
    assert width == 480 + 500


def test_wrong_settings_are_named():
    with pytest.raises(ConfigError, match="speed"):
        FilmSettings(speed=0)
    with pytest.raises(ConfigError, match="what"):
        FilmSettings(what="sound")  # type: ignore[arg-type]
    for wrong in (float("nan"), float("inf"), 1e300):
        with pytest.raises(ConfigError, match=r"start_s: .* is out of range"):
            FilmSettings(start_s=wrong)
        with pytest.raises(ConfigError, match=r"end_s: .* is out of range"):
            FilmSettings(end_s=-wrong)
    some = recording(random_events(np.random.default_rng(0), 9))
    with pytest.raises(ConfigError, match="end after the start"):
        Film([some], FilmSettings(start_s=2, end_s=1))
    with pytest.raises(ConfigError, match="pictures"):
        Film([some], FilmSettings(start_s=0, end_s=10**6))
    with pytest.raises(DataError, match="no poses"):
        Film([some], FilmSettings(what="frames"))
    with pytest.raises(DataError, match="neither"):
        Film([recording(empty_events())])


def test_a_sample_says_whether_it_slips():
    film = Film([simulated(0)], FilmSettings(what="events"))
    slipping, holding = (film.picture(t)[:CAPTION] for t in (2000, 4500))
    assert {tuple(c) for c in slipping.reshape(-1, 3)} != {tuple(c) for c in holding.reshape(-1, 3)}
    assert (slipping != holding).any()


@pytest.mark.parametrize("size", [(16384, 16384), (1, 65535)])
def test_a_sensor_that_no_picture_can_show_is_refused(size: tuple[int, int]):
    one = Events(*(np.zeros(2, dtype) for dtype in (np.int64, np.uint16, np.uint16, bool))).replace(t_us=np.arange(2))
    with pytest.raises(DataError, match="pixels, expected at most"):
        Film([Record(kind="recording", name="a", size=size, events=one)])
