"""The event camera with a readout behind its pixels."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from evslip.events import EventCamera, EventCameras, Events, PixelModel, Readout, concatenate, preset_file
from evslip.events.camera import Mode
from evslip.events.readout.settings import OFF
from evslip.utils.errors import ConfigError

SIZE = (40, 30)
BUSY = {"bus_rate_hz": 1e5, "buffer_events": 200, "lost_share": 0.05, "row_bursts_hz": 40.0, "jumps_hz": 40.0}
READOUTS: dict[str, dict[str, float]] = {
    "frames": {"frame_us": 400.0, "scan_us": 300.0},
    "rows": {"row_us": 20.0, **BUSY},
}


def frames(count: int = 24, labelled: bool = True) -> list[tuple[float, ...]]:
    """A texture that jumps about; labelled from the first frame on or not at all."""
    rng = np.random.default_rng(0)
    bodies = rng.integers(0, 5, (count, *SIZE[::-1])).astype(np.uint8)
    images = rng.uniform(0.2, 1.0, (count, *SIZE[::-1]))
    return [(1000.4 * k + 0.3, images[k], *((bodies[k],) if labelled else ())) for k in range(count)]


def camera(mode: Mode = "accurate", threads: int = 1, **readout: float) -> EventCamera:
    return EventCamera("noisy", size=SIZE, seed=3, mode=mode, threads=threads, readout=readout, refractory_us=300.0)


@pytest.mark.parametrize("mode", ["accurate", "v2e"])
@pytest.mark.parametrize("kind", READOUTS)
def test_events_do_not_depend_on_threads_or_on_how_frames_are_grouped(mode: Mode, kind: str):
    readout, given = READOUTS[kind], frames()
    one = camera(mode, **readout)
    whole = one.run(given)
    rest = one.waiting()
    assert whole.count > 1000 and rest.count > 0
    other = camera(mode, **readout)
    stepped = concatenate([other.step(*frame) for frame in given])
    assert stepped == whole and other.readout_counts == one.readout_counts and other.waiting() == rest
    halves = camera(mode, **readout)
    assert concatenate([halves.run(given[:7]), halves.run(given[7:])]) == whole
    if mode == "accurate":
        assert camera(mode, threads=3, **readout).run(given) == whole


def test_a_state_continues_in_the_middle():
    given = frames()
    one = camera(**READOUTS["rows"])
    begin = one.run(given[:11])
    two = EventCamera.from_state(one.state())
    assert two.run(given[11:]) == (rest := one.run(given[11:]))
    assert two.readout_counts == one.readout_counts
    one.reset()
    assert one.run(given) == concatenate([begin, rest])


def test_a_state_without_a_readout_is_one_whose_readout_is_off():
    state = camera().state()
    old = {name: value for name, value in state.items() if not name.startswith("readout")}
    assert EventCamera.from_state(old).readout == OFF


def test_off_is_off():
    given = frames()
    plain = EventCamera("noisy", size=SIZE, seed=3, refractory_us=300.0)
    off = camera(frame_us=0.0)
    assert off.run(given) == plain.run(given)
    assert off.readout_counts is None and off.waiting().count == 0


def test_a_frame_that_raises_leaves_the_readout_after_the_one_before_it():
    given = frames()
    one, two = camera(**READOUTS["frames"]), camera(**READOUTS["frames"])
    with pytest.raises(Exception, match="does not come after"):
        one.run([*given[:9], given[0]])
    two.run(given[:9])
    assert one.run(given[9:]) == two.run(given[9:]) and one.readout_counts == two.readout_counts


def test_labels_stay_with_their_events():
    given = frames()
    fired = EventCamera("noisy", size=SIZE, seed=3, refractory_us=300.0).run(given)
    one = camera(**READOUTS["frames"])
    read = concatenate([one.run(given), one.waiting()])

    def rows(events: Events) -> set[tuple[int, ...]]:
        columns = (events.x, events.y, events.p, events.body, events.cause)
        return set(zip(*(np.asarray(column).tolist() for column in columns), strict=True))

    assert rows(read) <= rows(fired)
    assert EventCamera("noisy", size=SIZE, readout={"frame_us": 9.0}).run(frames(labelled=False)).body is None


def test_a_readout_comes_by_name_as_a_whole_or_from_a_file(tmp_path: Path):
    wanted = Readout(frame_us=200.0, lost_share=0.1)
    path = tmp_path / "own.toml"
    path.write_text(preset_file.text(PixelModel(theta=0.3), {}, readout=wanted))
    assert EventCamera(str(path), size=SIZE).readout == wanted
    assert EventCamera(str(path), size=SIZE, readout={"lost_share": 0.0}).readout == Readout(frame_us=200.0)
    assert EventCameras(2, size=SIZE, readout=wanted).cameras[1].readout == wanted
    assert preset_file.read_readout(path) == wanted and preset_file.read(path) == PixelModel(theta=0.3)


@pytest.mark.parametrize(
    ("section", "message"),
    [
        ("readout = 3", "readout: expected a section"),
        ("[readout]\nframe = 3.0", "readout.frame: unknown parameter"),
        ("[readout]\nframe_us = -3.0", "readout.frame_us: -3.0 is out of range"),
    ],
)
def test_a_wrong_readout_in_a_file_is_named(tmp_path: Path, section: str, message: str):
    path = tmp_path / "own.toml"
    path.write_text(f'format = "{preset_file.FORMAT}"\nversion = 1\n{section}\n')
    with pytest.raises(ConfigError, match=message) as caught:
        EventCamera(str(path), size=SIZE)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)


def test_a_readout_that_is_off_is_not_even_loaded():
    code = (
        "import sys; import numpy as np; from evslip.events import EventCamera;"
        "camera = EventCamera('clean', size=(8, 6));"
        "camera.run((1000.0 * k, np.full((6, 8), 0.2 + 0.1 * k)) for k in range(3));"
        "found = [name for name in sys.modules if name.startswith('evslip.events.readout.')];"
        "print(' '.join(sorted(name.rpartition('.')[2] for name in found)))"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert said.split() == ["settings"]
