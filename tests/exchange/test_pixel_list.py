"""Lists of pixels that are left out: written by `evslip info --hot`, read by `evslip convert --without`."""

import json
from pathlib import Path

import numpy as np
import pytest

from evslip.cli import run
from evslip.codecs import read_events, write_events
from evslip.events import Events
from evslip.exchange.pixel_list import read_pixels, write_pixels
from evslip.exchange.selection import Selection
from evslip.exchange.selector import Selector
from evslip.utils.errors import ConfigError, DataError

SIZE = (40, 30)


def noisy_with_a_hot_pixel() -> Events:
    rng = np.random.default_rng(0)
    t_us = np.sort(rng.integers(0, 2_000_000, 4000))
    x, y = (rng.integers(0, side, 4000).astype(np.uint16) for side in SIZE)
    x[::4], y[::4] = 12, 7
    return Events(t_us, x, y, rng.random(4000) < 0.5)


def test_hot_pixels_are_listed_and_left_out(tmp_path: Path, capsys):
    events = noisy_with_a_hot_pixel()
    for name in ("a.dat", "a.csv"):  # of which one does not state the sensor's size
        write_events(tmp_path / name, events, SIZE)
        run(["info", str(tmp_path / name), "--hot", str(tmp_path / "hot.csv")])
        assert read_pixels(tmp_path / "hot.csv") == ((12, 7),)
    assert "1 pixels with 25." in capsys.readouterr().out
    run(["convert", str(tmp_path / "a.dat"), str(tmp_path / "b.npz"), "--without", str(tmp_path / "hot.csv")])
    assert read_events(tmp_path / "b.npz") == events.select((events.x != 12) | (events.y != 7))
    capsys.readouterr()
    run(["info", str(tmp_path / "a.dat"), "--json"])
    told = json.loads(capsys.readouterr().out)
    assert told["quality"]["pixels"]["hot"] == [[12, 7]]
    assert any(line.startswith("hot pixels") for line in told["quality"]["harms"])


def test_pixels_are_left_out_before_the_crop():
    events = noisy_with_a_hot_pixel()
    selector = Selector(Selection((10, 5, 20, 20), without=((12, 7), (39, 29))), SIZE)
    (kept,) = selector.of([events])
    assert kept.count and not ((kept.x == 2) & (kept.y == 2)).any()
    with pytest.raises(ConfigError, match="pixel x 40 y 3 is beyond the sensor's 40 x 30"):
        Selector(Selection(without=((40, 3),)), SIZE)


def test_lists_are_read_as_written_and_wrong_lines_named(tmp_path: Path):
    path = tmp_path / "p.csv"
    write_pixels(path, np.array([[3, 4], [65535, 0]]))
    assert read_pixels(path) == ((3, 4), (65535, 0))
    path.write_text("1, 2\n\n")
    assert read_pixels(path) == ((1, 2),)
    for wrong in ("1", "1,2,3", "a,b", "1,-2", "70000,1", "1.5,2"):
        path.write_text(f"x,y\n{wrong}\n")
        with pytest.raises(DataError, match=r"line 2: .* expected x,y"):
            read_pixels(path)
