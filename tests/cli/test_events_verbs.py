"""`evslip events` as a user types it, well and wrongly."""

import dataclasses
import sys
from typing import Any

import av
import numpy as np
import pytest
from PIL import Image

from evslip.cli import main
from evslip.cli.events import PixelOptions, parameters_of
from evslip.data.record_file import read_recording
from evslip.events import EventCamera, save_noise_map
from evslip.events.pixel_model import PARAMETERS
from evslip.events.readout.settings import READOUT_PARAMETERS


@pytest.fixture
def work(tmp_path, monkeypatch):
    """A folder with clips, good and bad, as the working directory."""
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(0)
    frames = rng.integers(0, 255, (6, 12, 16), np.uint8)
    for folder in ("images", "mixed", "empty", "broken"):
        (tmp_path / folder).mkdir()
    for number, image in enumerate(frames):
        Image.fromarray(image).save(tmp_path / "images" / f"{number}.png")
        Image.fromarray(image[: 12 - number]).save(tmp_path / "mixed" / f"{number}.png")
        Image.fromarray(image).save(tmp_path / "broken" / f"{number}.png")
    (tmp_path / "broken" / "4.png").write_bytes((tmp_path / "broken" / "4.png").read_bytes()[:60])
    np.savez("clip.npz", frames=frames, t_us=np.arange(6) * 1000)
    np.savez("nan.npz", frames=np.where(frames == frames[4, 3, 2], np.nan, frames / 255), t_us=np.arange(6) * 1000)
    np.savez("objects.npz", frames=np.array([None, "x"]), t_us=np.arange(2))
    (tmp_path / "five.csv").write_text("0\n1000\n2000\n3000\n4000\n")
    (tmp_path / "back.csv").write_text("t_us\n0\n1000\n2000\n1500\n4000\n5000\n")
    with av.open("clip.mp4", "w", options={"movflags": "faststart"}) as container:
        stream: Any = container.add_stream("libx264", rate=50)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        for _ in range(20):
            picture = rng.integers(0, 255, (48, 64, 3), np.uint8)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode())
    whole = (tmp_path / "clip.mp4").read_bytes()
    (tmp_path / "cut.mp4").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "theta.npy").write_bytes(b"\x93NUMPY nothing")
    return tmp_path


def evslip(monkeypatch, text: str) -> int:
    monkeypatch.setattr(sys, "argv", ["evslip", *text.split()])
    try:
        main()
    except SystemExit as stopped:
        return int(stopped.code or 0)
    return 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("nowhere OUT --fps 10", ["nowhere"]),
        ("empty OUT --fps 10", ["empty", "no images"]),
        ("mixed OUT --fps 10", ["mixed/1.png", "16x11", "16x12"]),
        ("broken OUT --fps 10", ["broken/4.png", "truncated"]),
        ("images OUT", ["fps", "images"]),
        ("images OUT --fps 0", ["fps"]),
        ("images OUT --fps nan", ["fps"]),
        ("images OUT --fps fast", ["--fps", "'fast'", "number"]),
        ("images OUT --times back.csv", ["back.csv", "frame 3"]),
        ("images OUT --times five.csv", ["5 times", "6 frames"]),
        ("images OUT --times none.csv", ["none.csv"]),
        ("images OUT --times five.csv --times-unit ms", ["times-unit", "us, s"]),
        ("images OUT --times five.csv --fps 3", ["fps", "times"]),
        ("cut.mp4 OUT", ["cut.mp4", "truncated"]),
        ("five.csv OUT", ["five.csv"]),
        ("nan.npz OUT", ["nan.npz", "NaN"]),
        ("objects.npz OUT", ["objects.npz", "objects"]),
        ("clip.npz OUT --camera davis", ["davis", "davis346"]),
        ("clip.npz OUT --mode quick", ["quick", "accurate, v2e"]),
        ("clip.npz OUT --intensity log", ["log", "srgb"]),
        ("clip.npz OUT --interpolate cubic", ["cubic", "linear, none, flow, rife"]),
        ("clip.npz OUT --theta 9", ["theta", "9"]),
        ("clip.npz OUT --theta high", ["--theta", "'high'"]),
        ("clip.npz OUT --theta-on high", ["theta_on", "'high'", ".npy"]),
        ("clip.npz OUT --theta-on theta.npy", ["theta.npy"]),
        ("clip.npz OUT --leak-map none.npy", ["none.npy"]),
        ("clip.npz OUT --noise-map none.npz", ["none.npz"]),
        ("clip.npz OUT --hot-share 0.1 --mode v2e", ["hot_share", "v2e"]),
        ("clip.npz OUT --lost-share 2", ["lost_share", "0 to 1"]),
        ("clip.npz OUT --frame-us 100 --row-us 1", ["frame_us", "row_us"]),
        ("clip.npz OUT --seed -1", ["seed"]),
        ("clip.npz OUT --seed 1.5", ["--seed", "1.5"]),
        ("clip.npz OUT --threads 0", ["threads"]),
        ("clip.npz OUT --preview p.png", ["p.png", ".mp4"]),
        ("clip.npz OUT --preview p.mp4 --preview-ms 0", ["preview-ms"]),
        ("clip.npz OUT --plot p.mp4", ["p.mp4", ".png"]),
        ("clip.npz clip.npz", ["clip.npz", "itself"]),
        ("clip.npz out/e.bin", ["e.bin", ".h5"]),
        ("clip.npz five.csv/e.h5", ["five.csv/e.h5"]),
        ("clip.npz OUT --thetta 1", ["--thetta"]),
        ("clip.npz", ["missing: OUT"]),
    ],
)
def test_what_is_wrong_takes_one_line_and_leaves_nothing(arguments, words, work, monkeypatch, capfd):
    before = sorted(work.rglob("*"))
    assert evslip(monkeypatch, "events " + arguments.replace("OUT", "out/e.h5")) == 2
    error = capfd.readouterr().err
    assert len(error.strip().splitlines()) == 1, error
    assert all(word in error for word in words), error
    assert sorted(work.rglob("*")) == before


def test_every_parameter_of_the_camera_is_an_option():
    options: Any = PixelOptions()
    assert [option.name for option in dataclasses.fields(options)] == list(PARAMETERS)
    assert parameters_of(options) == {}


def test_help_gives_units_and_limits(monkeypatch, capfd):
    assert evslip(monkeypatch, "events --help") == 0
    text = " ".join(capfd.readouterr().out.replace("│", " ").split())
    for name in (*PARAMETERS, *READOUT_PARAMETERS):
        assert f"--{name.replace('_', '-')} " in text
    assert "[us, 0 to 1e+06]" in text
    assert "none: a frame stands still" in text


def test_options_reach_the_camera(work, monkeypatch, capfd):
    rng = np.random.default_rng(1)
    theta, rates = rng.uniform(0.1, 0.4, (12, 16)), rng.uniform(0, 50, (2, 12, 16))
    np.save("theta.npy", theta)
    save_noise_map("noise.npz", rates)
    text = "events clip.npz e.h5 --camera noisy --theta-on theta.npy --theta-off 0.3 --noise-map noise.npz --seed 4"
    assert evslip(monkeypatch, text + " --intensity srgb --preview p.mp4 --plot r.png") == 0
    printed = capfd.readouterr().out
    camera = EventCamera(
        "noisy", size=(16, 12), seed=4, intensity="srgb", theta_on=theta, theta_off=0.3, noise_map=rates
    )
    with np.load("clip.npz") as arrays:
        expected = camera.run(zip(arrays["t_us"], arrays["frames"], strict=True))
    events = read_recording("e.h5").events
    assert f"{expected.count:,} events" in printed
    np.testing.assert_array_equal(events.t_us, expected.t_us)
    np.testing.assert_array_equal(events.x, expected.x)
    assert (work / "p.mp4").stat().st_size > 500
    assert (work / "r.png").stat().st_size > 500
    assert evslip(monkeypatch, "show e.h5") == 0
    shown = capfd.readouterr().out
    assert '"theta_off": 0.3' in shown
    assert '"intensity": "srgb"' in shown


def test_a_readout_is_used_said_and_kept(work, monkeypatch, capfd):
    assert evslip(monkeypatch, "events clip.npz e.h5 --camera noisy --frame-us 400 --lost-share 0.5") == 0
    printed = " ".join(capfd.readouterr().out.split())
    with np.load("clip.npz") as arrays:
        frames = list(zip(arrays["t_us"], arrays["frames"], strict=True))
    camera = EventCamera("noisy", size=(16, 12), intensity="uint8", readout={"frame_us": 400.0, "lost_share": 0.5})
    assert read_recording("e.h5").events.count == camera.run(frames).count
    assert camera.readout_counts is not None
    assert f"readout: {sum(camera.readout_counts.offered):,} events offered" in printed
    assert evslip(monkeypatch, "show e.h5") == 0
    assert '"frame_us": 400.0' in capfd.readouterr().out


def test_bright_floats_and_formats_without_settings_are_remarked(work, monkeypatch, capfd):
    np.savez("bright.npz", frames=np.full((3, 4, 5), 200.0), t_us=np.arange(3))
    assert evslip(monkeypatch, "events bright.npz e.csv") == 0
    printed = capfd.readouterr().out
    assert "--intensity uint8" in printed
    assert ".csv files have no place" in printed
