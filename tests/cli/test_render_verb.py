"""`evslip render` as a user types it, well and wrongly."""

import sys

import av
import numpy as np
import pytest
from PIL import Image

from evslip.cli import main
from evslip.config.loading import load_config
from evslip.data import record_file
from evslip.data.record import Record
from evslip.draws.draw import draw
from evslip.events.stream import empty_events
from evslip.physics.simulation import simulate
from evslip.physics.truth import measure
from evslip.rendering import render, render_color
from evslip.rendering.outputs import Outputs
from evslip.scene.textures.library import linear_to_srgb
from evslip.view.pictures.replay import instants


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    """The path of a record without events, and the record."""
    params = draw(load_config("demo", {"camera.width": 48, "camera.height": 36}), 0)
    traj = simulate(params)
    record = Record(
        kind="simulated",
        name="train/0000000",
        split="train",
        index=0,
        size=(48, 36),
        events=empty_events(),
        params=params,
        trajectory=traj,
        truth=measure(traj),
    )
    path = tmp_path_factory.mktemp("records") / "0000000.h5"
    record_file.write(path, record)
    return path, record_file.read(path)


def run(monkeypatch, *words):
    """The exit code, and the text on stderr."""
    monkeypatch.setattr(sys, "argv", ["evslip", *map(str, words)])
    main()


def test_a_folder_holds_the_luminance_frames_as_pictures(stored, tmp_path, monkeypatch):
    path, record = stored
    run(monkeypatch, "render", path, "--out", tmp_path / "out", "--times", 2.5, "--times", 2.0)
    files = sorted((tmp_path / "out").iterdir())
    assert [file.name for file in files] == ["000000_0002000000us.png", "000001_0002500000us.png"]
    (frame,) = render(record.trajectory, times_us=np.array([2_500_000]))
    expected = np.round(linear_to_srgb(frame.luminance) * 255)
    assert np.array_equal(np.asarray(Image.open(files[1])), expected)


def test_colour_size_and_outputs(stored, tmp_path, monkeypatch):
    path, record = stored
    words = ("--times", 2.0, "--color", "--size", "64x48", "--outputs", "depth,motion")
    run(monkeypatch, "render", path, "--out", tmp_path, *words)
    (picture,), (arrays,) = tmp_path.glob("*.png"), tmp_path.glob("*.npz")
    expected = render_color(record.trajectory, 2_000_000, size=(64, 48))
    assert np.array_equal(np.asarray(Image.open(picture)), expected)
    from evslip.rendering.camera import hand_camera

    made = Outputs(record.trajectory, hand_camera(record.params, (64, 48)), ("depth", "motion")).at(2_000_000)
    with np.load(arrays) as loaded:
        assert set(loaded) == {"t_us", "depth", "motion"} and loaded["t_us"] == 2_000_000
        assert all(np.array_equal(loaded[name], made[name]) for name in made)


def test_a_video_shows_a_phase_at_true_speed(stored, tmp_path, monkeypatch):
    path, record = stored
    run(monkeypatch, "render", path, "--out", tmp_path / "tilt.mp4", "--phase", "tilt", "--every", 100)
    times = instants(record, every_ms=100, phase="tilt")
    with av.open(str(tmp_path / "tilt.mp4")) as container:
        frames = list(container.decode(video=0))
    assert len(frames) == len(times) > 5 and (frames[0].width, frames[0].height) == (48, 36)


def test_instants_cover_the_recorded_span(stored):
    _, record = stored
    start, end = record.truth.span_us
    times = instants(record)
    assert times[0] == start and end - 40_000 < times[-1] <= end
    assert np.diff(times) == pytest.approx(1e6 / 30, abs=1)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--out", "a.gif"), "a.gif: no kind of video"),
        (("--out", "a.mp4", "--outputs", "depth"), "give a folder"),
        (("--out", "a", "--outputs", "colour"), "'colour' is unknown"),
        (("--out", "a", "--outputs", "depth", "--camera", "scene"), "leave out camera"),
        (("--out", "a", "--size", "12"), "--size: '12' given, expected WIDTH HEIGHT"),
        (("--out", "a", "--size", "5x5"), "from 16 to 4096"),
        (("--out", "a", "--phase", "dance"), "this record has approach"),
        (("--out", "a", "--phase", "tilt", "--times", "1"), "cannot be combined"),
        (("--out", "a", "--times", "99"), "outside of the trajectory"),
        (("--out", "a", "--times", "nan"), "times: nan is out of range"),
        (("--out", "a", "--times", "1e300"), "times: 1e+300 is out of range"),
        (("--out", "a", "--every", "0"), "every: 0.0 is out of range"),
        (("--out", "a", "--key-motion", "nan"), "render.key_motion_px: nan is out of range"),
        (("--out", "a", "--spp", "0"), "render.spp: 0 is out of range"),
        (("--out", "a", "--times", "1", "--camera", "scene"), "use pathtrace"),
    ],
)
def test_wrong_requests_take_one_line(stored, tmp_path, monkeypatch, capsys, words, message):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as stopped:
        run(monkeypatch, "render", stored[0], *words)
    said = capsys.readouterr().err
    assert stopped.value.code == 2 and message in said and said.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_record_without_poses_is_named(tmp_path, monkeypatch, capsys):
    recording = Record(kind="recording", name="clip", size=(48, 36), events=empty_events())
    record_file.write(tmp_path / "clip.h5", recording)
    with pytest.raises(SystemExit) as stopped:
        run(monkeypatch, "render", tmp_path / "clip.h5", "--out", tmp_path / "out")
    assert stopped.value.code == 2 and "a recording has no poses" in capsys.readouterr().err
