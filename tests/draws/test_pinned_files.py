"""A data set is of the files that it was begun with."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

import evslip
from evslip.config.loading import config_from_text, dump_config, load_config
from evslip.draws.draw import draw
from evslip.draws.draw_plan import pinned
from evslip.events import preset_file, presets
from evslip.utils.errors import ConfigError

CHANGED = r"files_sha256: .* the digest of these files is \w{12}\.\.\., expected \w{12}\.\.\.; bring the old files back"


def an_image(path: Path, grey: int = 0) -> None:
    Image.fromarray(np.full((8, 8), grey, np.uint8)).save(path)


@pytest.fixture
def config(tmp_path):
    """A configuration of images, of a mesh and of a sensor's preset, all in files."""
    (tmp_path / "photos").mkdir()
    for k in range(6):
        an_image(tmp_path / "photos" / f"{k}.png", 40 * k)
    trimesh.creation.box((0.05, 0.05, 0.08)).export(tmp_path / "box.stl")
    own = replace(presets.named("davis346"), leak_map=np.full((260, 346), 1.0, np.float32))
    preset_file.write(tmp_path / "mine.toml", own, {})
    return load_config(
        "simple",
        {
            "object.texture": str(tmp_path / "photos"),
            "object.shape": "mesh",
            "object.mesh": str(tmp_path / "box.stl"),
            "sensor.preset": ["davis346", str(tmp_path / "mine.toml")],
            "test_share": 0.5,
        },
    )


def test_without_files_nothing_is_noted():
    assert "files_sha256" not in dump_config(pinned(load_config("complex")))


def test_the_digest_is_of_names_and_contents_and_changes_no_draw(config):
    noted = pinned(config)
    assert len(noted.files_sha256) == 64 and pinned(noted) == noted
    assert config_from_text(dump_config(noted)) == noted
    assert draw(noted, 3, "test") == draw(config, 3, "test")


@pytest.mark.parametrize(
    "change",
    [
        lambda folder: an_image(folder / "photos" / "6.png"),
        lambda folder: an_image(folder / "photos" / "2.png", 81),
        lambda folder: (folder / "photos" / "2.png").unlink(),
        lambda folder: (folder / "photos" / "2.png").rename(folder / "photos" / "2b.png"),
        lambda folder: trimesh.creation.box((0.05, 0.05, 0.09)).export(folder / "box.stl"),
        lambda folder: (folder / "mine.toml").write_bytes((folder / "mine.toml").read_bytes() + b"\n"),
        lambda folder: (folder / "mine.npz").write_bytes((folder / "mine.npz").read_bytes() + b"\n"),
    ],
    ids=[
        "a new image",
        "another image",
        "an image less",
        "another name",
        "another mesh",
        "another preset",
        "other maps",
    ],
)
def test_with_other_files_nothing_is_drawn_or_made(config, change, tmp_path):
    """Also in the process that drew from the old files: it keeps no digest and no list of them."""
    text = dump_config(pinned(config))
    draw(config, 0)
    change(tmp_path)
    assert pinned(config).files_sha256 != config_from_text(text).files_sha256
    with pytest.raises(ConfigError, match=CHANGED):
        draw(config_from_text(text), 0)
    with pytest.raises(ConfigError, match=CHANGED):
        evslip.generate(config_from_text(text), tmp_path / "data", 1)
    assert not (tmp_path / "data").exists()


def test_a_data_set_of_other_images_is_not_gone_on_with(tmp_path):
    (tmp_path / "photos").mkdir()
    for k in range(3):
        an_image(tmp_path / "photos" / f"{k}.png", 90 * k)
    small = {"camera.width": 32, "camera.height": 24, "motion.duration_s": 6.0, "test_share": 0.0}
    config = load_config("simple", small | {"surface.texture": str(tmp_path / "photos")})
    evslip.generate(config, tmp_path / "data", 1, workers=1)
    an_image(tmp_path / "photos" / "3.png")
    with pytest.raises(ConfigError, match=r"data set of another configuration: files_sha256 is .* there and .* now"):
        evslip.generate(config, tmp_path / "data", 2, workers=1)
    (tmp_path / "photos" / "3.png").unlink()
    assert len(evslip.generate(config, tmp_path / "data", 2, workers=1).made) == 1
