"""What a sample will cost, before it is made."""

from pathlib import Path

import numpy as np
import pytest

from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.events import preset_file
from evslip.events.pixel_model import PixelModel
from evslip.generation import estimate as cost
from evslip.generation.generate import generate
from evslip.utils.errors import ConfigError

HUGE = {"camera.width": 4096, "camera.height": 4096, "sensor.shot_rate_hz": 1000.0}


def test_an_estimate_of_simple_is_what_was_measured():
    found = cost.estimate(draw(load_config("simple"), 0))
    # docs/explanation/benchmarks.md and docs/how-to/reliability.md: 3.75 M events, 3.14 bytes each, 583 MB at most.
    assert found.events == pytest.approx(3.75e6, rel=0.2)
    assert found.file_bytes == pytest.approx(3.75e6 * 3.14, rel=0.2)
    assert found.memory_bytes == pytest.approx(583e6, rel=0.2)


def test_noise_counts_for_every_pixel_and_second():
    few, many = (
        cost.estimate(draw(load_config("simple", {"sensor.shot_rate_hz": rate, "sensor.leak_rate_hz": 0.0}), 0))
        for rate in (0.0, 100.0)
    )
    seconds = (many.events - few.events) / (346 * 260 * 100)
    assert 5 < seconds < 15  # a sample of `simple` lasts that long


def test_bursts_of_the_readout_count_too():
    few, many = (
        cost.estimate(draw(load_config("simple", {"readout.row_bursts_hz": rate, "readout.pixel_bursts_hz": rate}), 0))
        for rate in (0.0, 10.0)
    )
    assert 5 < (many.events - few.events) / (10 * (346 + 1000)) < 15


def test_hot_pixels_and_measured_noise_count_too(tmp_path: Path):
    noise = np.full((2, 260, 346), 100.0)
    presets = {"quiet": {}, "hot": {"hot_share": 1.0, "hot_rate_hz": 200.0}, "mapped": {"noise_map": noise}}
    events = {}
    for name, values in presets.items():
        preset_file.write(tmp_path / f"{name}.toml", PixelModel(**values), {})
        changed = {"sensor.preset": str(tmp_path / f"{name}.toml"), "sensor.leak_rate_hz": 0.0}
        events[name] = cost.estimate(draw(load_config("simple", changed | {"sensor.shot_rate_hz": 0.0}), 0)).events
    made = [(events[name] - events["quiet"]) / (346 * 260 * 200) for name in ("hot", "mapped")]
    assert all(5 < seconds < 15 for seconds in made)


def test_what_cannot_fit_is_refused_before_a_folder_is_made(tmp_path: Path):
    words = r"126,501 million events, .* GB on disk, .* TB of memory and .* h of processor time, and this machine has"
    with pytest.raises(ConfigError, match=words):
        generate(load_config("demo", HUGE), tmp_path / "out", 1)
    assert not any(tmp_path.iterdir())


def test_a_large_sample_is_told_and_a_small_one_is_not(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(cost, "installed_memory", lambda: 8e9)
    monkeypatch.setattr(cost, "free_disk", lambda root: 1e12)
    small = cost.Estimate(1e6, 3e6, 5e8, 10.0)
    assert cost.require_room(small, 100, 2, tmp_path) is None
    said = cost.require_room(small, 100, 32, tmp_path)
    assert said is not None and "32 at once take more memory than the machine's 8 GB" in said
    said = cost.require_room(small._replace(memory_bytes=3e9), 100, 2, tmp_path)
    costs = "a sample takes about 1 million events, 3 MB on disk, 3 GB of memory and 10 s of processor time"
    assert said == f"{costs}; 100 of them 300 MB"
    with pytest.raises(ConfigError, match="this machine has 8 GB: expected fewer pixels"):
        cost.require_room(small._replace(memory_bytes=9e9), 1, 1, tmp_path)
    with pytest.raises(ConfigError, match="and 1 TB are free in"):
        cost.require_room(small, 2_000_000, 1, tmp_path)
