import dataclasses
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import evslip
from command_line import evslip as evslip_verb
from evslip.config.loading import dump_config, load_config
from evslip.data import building, record_file
from evslip.data.dataset import open_dataset
from evslip.physics.truth import measure
from evslip.utils.errors import ConfigError, DataError
from evslip.view.pictures.window_pictures import PICTURES, name_of, write_windows
from evslip.windows.window_set import WindowSettings
from sample_records import CONFIG, random_events, simulated
from two_cameras import KEYS, seen_by_two


@pytest.mark.slow
def test_every_window_has_its_pictures(tmp_path: Path):
    import av

    params = evslip.draw(CONFIG, 0, "train")
    trajectory = evslip.simulate(params)
    truth = measure(trajectory)
    events = random_events(np.random.default_rng(0), 3000)
    first, last = truth.span_us
    events = events.replace(t_us=first + events.t_us * (last - first) // 50_000)
    root = tmp_path / "data"
    building.create(root, dump_config(CONFIG))
    sample = dataclasses.replace(simulated(0), params=params, trajectory=trajectory, truth=truth, events=events)
    building.add(root, sample, record_file.encode(sample))
    samples = open_dataset(root)
    settings = WindowSettings(
        hop_s=1.5, balance=False, left=0, top=0, width=40, height=30, sensor_width=40, sensor_height=30
    )
    cut = samples.windows(settings)
    made = []
    write_windows(tmp_path / "pictures", cut, samples, lambda: made.append(1))
    assert len(made) == len(cut) > 1
    names = {path.name for path in (tmp_path / "pictures").iterdir()}
    assert len(names) == len(cut) * (2 * PICTURES + 1)
    for index in range(len(cut)):
        name = name_of(cut, index)
        assert name.startswith("slip" if cut.label[index] else "hold")
        plain, shown = (np.asarray(Image.open(tmp_path / "pictures" / f"{name}_3{end}.png")) for end in ("", "_events"))
        assert plain.shape == (30, 40, 3)
        assert (plain[..., 0] == plain[..., 1]).all()
        start, length = int(cut.start_us[index]), round(1e6 * settings.length_s)
        seen = events.between(start + 3 * length // PICTURES, start + 4 * length // PICTURES)
        coloured = (shown[..., 0] != shown[..., 2]).sum()
        assert coloured == len(set(zip(seen.x, seen.y, strict=True))) > 0
        with av.open(tmp_path / "pictures" / f"{name}.mp4") as container:
            assert len(list(container.decode(video=0))) == 48  # 0.16 s, ten times slower, at 30 a second


def test_a_file_in_the_way_is_named(tmp_path: Path):
    (tmp_path / "file").write_text("")
    with pytest.raises(DataError, match="is a file"):
        write_windows(tmp_path / "file", None, None)  # type: ignore[arg-type]


def test_windows_of_two_cameras_are_refused_together(tmp_path: Path):
    root = tmp_path / "data"
    building.create(root, dump_config(load_config("demo", KEYS)))
    sample = seen_by_two()
    building.add(root, sample, record_file.encode(sample))
    with pytest.raises(ConfigError, match=r"visualize: .*several cameras.* expected --camera left"):
        write_windows(tmp_path / "pictures", None, open_dataset(root).seen_by("all"))  # type: ignore[arg-type]
    done = evslip_verb("windows", root, tmp_path / "w.h5", "--camera", "all", "--visualize", tmp_path / "pictures")
    assert done.returncode == 2 and "several cameras" in done.stderr
    assert {path.name for path in tmp_path.iterdir()} == {"data"}
