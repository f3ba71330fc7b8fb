"""Records of samples whose light flickers, seen through a lens that is not clean."""

import hashlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import evslip
from evslip.config.loading import load_config
from evslip.data.record import Record
from evslip.draws.draw import draw
from evslip.generation.estimate import estimate
from evslip.generation.generate import make_record
from evslip.generation.sensor import camera_for
from evslip.rendering import render

SMALL = {"camera.width": 48, "camera.height": 36, "motion.duration_s": 6.0, "sensor.preset": "clean"}
FLICKER = {"flicker.lamp_depth": {"min": 0.2, "max": 0.3}, "flicker.frequency_hz": [100.0, 120.0]}
DIRT = {"lens.spots": 8.0, "lens.glare": 0.05}
SHORT = {"robot.kind": "cartesian", "motion.kind": "hold", "motion.duration_s": 3.0, "motion.hold_s": 0.4}


def config(**overrides: Any) -> evslip.Config:
    return load_config("simple", SMALL | overrides)


@pytest.fixture(scope="module")
def nuisances() -> Record:
    return make_record(draw(config(**FLICKER, **DIRT), 0))


def sums(root: Path) -> dict[str, str]:
    files = (path for path in (root / "samples").rglob("*") if path.is_file())
    return {str(path.relative_to(root)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def test_records_do_not_depend_on_the_number_of_workers(tmp_path: Path):
    for workers in (1, 2):
        evslip.generate(config(**FLICKER, **DIRT, **SHORT), tmp_path / str(workers), 3, workers=workers)
    assert sums(tmp_path / "1") == sums(tmp_path / "2") != {}


def test_events_do_not_depend_on_threads(nuisances: Record):
    assert nuisances.trajectory is not None and nuisances.params is not None
    events = camera_for(nuisances.params, threads=2).run(render(nuisances.trajectory))
    assert np.array_equal(events.t_us, nuisances.events.t_us) and np.array_equal(events.x, nuisances.events.x)


def test_what_happens_does_not_depend_on_the_light(nuisances: Record):
    plain = make_record(draw(config(), 0))
    assert plain.truth is not None and nuisances.truth is not None
    assert np.array_equal(plain.truth.theta_deg, nuisances.truth.theta_deg)
    assert nuisances.stats["frames"] > 2 * plain.stats["frames"]
    assert nuisances.events.count > 2 * plain.events.count


@pytest.mark.parametrize("waveform", ["sine", "pwm"])
def test_the_cost_of_a_flicker_is_estimated(waveform: str):
    own = {"flicker.lamp_depth": 0.5, "flicker.surroundings_depth": 0.5, "flicker.waveform": waveform}
    params = draw(config(**own), 0)
    made, expected = make_record(params).events.count, estimate(params).events
    assert 1 / 3 < made / expected < 3
    assert expected > 3 * estimate(draw(config(), 0)).events
