"""Data sets that mix motions, mounts, sensors and meshes: their keys take lists like any other."""

import numpy as np
import pytest
import trimesh

import evslip
from evslip.cli import main
from evslip.config.loading import config_from_text, dump_config
from evslip.config.params import Params
from evslip.draws.draw import grid_size
from evslip.draws.draw_sheet import draw_sheet
from evslip.draws.separation import separate
from evslip.physics.onset import onset_mass
from evslip.utils.errors import ConfigError
from evslip.view.pictures.distributions import write_distributions

WAY = [{"y_m": -0.1, "z_m": 0.05}]
LISTS = {
    "motion.kind": ["pick_and_place", "hold", "shake", "waypoints"],
    "camera.mount": ["side", "front"],
    "sensor.preset": ["davis346", "clean", "noisy"],
}
MIXED = {**LISTS, "motion.waypoints": WAY}
TINY = {
    "camera.width": 32,
    "camera.height": 24,
    "render.max_motion_px": 4.0,
    "motion.duration_s": 4.0,
    "motion.hold_s": 0.3,
    "motion.cycles": 1,
    "object.mass_kg": 0.02,
    "robot.kind": "cartesian",
}


@pytest.fixture(scope="module")
def meshes(tmp_path_factory) -> list[str]:
    folder, paths = tmp_path_factory.mktemp("meshes"), []
    for k in range(4):
        paths.append(str(folder / f"{k}.stl"))
        trimesh.creation.cylinder(radius=0.03, height=0.08, sections=8 + 4 * k).export(paths[-1])
    return paths


def value(params: Params, key: str) -> object:
    section, name = key.split(".")
    return getattr(getattr(params, section), name)


def run(monkeypatch, *words: str) -> None:
    monkeypatch.setattr("sys.argv", ["evslip", *words])
    main()


@pytest.mark.parametrize("sampling", ["grid", "random"])
@pytest.mark.parametrize("split", ["train", "test"])
def test_every_name_of_a_list_is_drawn_in_both_splits(sampling, split):
    config = evslip.load_config("complex", {**MIXED, "sampling": sampling})
    drawn = [evslip.draw(config, index, split) for index in range(48)]
    for key, names in LISTS.items():
        assert {value(params, key) for params in drawn} == set(names)
    if sampling == "grid":
        assert grid_size(config, split) == 24
        assert len({tuple(value(params, key) for key in LISTS) for params in drawn[:24]}) == 24


def test_only_samples_that_visit_way_points_have_them():
    config = evslip.load_config("complex", MIXED)
    for params in (evslip.draw(config, index) for index in range(24)):
        assert (params.motion.waypoints is not None) == (params.motion.kind == "waypoints")
        assert Params.from_json(params.model_dump_json()) == params
    assert config_from_text(dump_config(config)) == config


def test_way_points_are_needed_where_they_are_among_the_kinds_and_nowhere_else():
    with pytest.raises(ConfigError, match=r"motion\.waypoints: is missing"):
        evslip.load_config("complex", {"motion.kind": ["hold", "waypoints"]})
    with pytest.raises(ConfigError, match=r"motion\.waypoints: needs motion\.kind"):
        evslip.load_config("complex", {"motion.kind": ["hold", "shake"], "motion.waypoints": WAY})


def test_a_list_of_one_name_leaves_all_other_values_alone():
    alone = evslip.load_config("complex", {"motion.kind": "shake", "sensor.preset": "clean"})
    listed = evslip.load_config("complex", {"motion.kind": ["shake"], "sensor.preset": ["clean"]})
    assert [evslip.draw(alone, i) for i in range(5)] == [evslip.draw(listed, i) for i in range(5)]


def test_meshes_are_divided_between_the_splits(meshes):
    config = evslip.load_config("complex", {"object.shape": "mesh", "object.mesh": meshes, **MIXED})
    found = separate(config, {"train": 20, "test": 20})
    assert not found.shared()
    assert found.values["object.mesh"]["train"] | found.values["object.mesh"]["test"] == set(meshes)
    assert all(found.kinds[key] == {"train": set(LISTS[key]), "test": set(LISTS[key])} for key in LISTS)


def test_a_share_of_slips_holds_for_every_mixture():
    config = evslip.load_config("complex", {**MIXED, "slip_fraction": 0.5})
    drawn = [evslip.draw(config, index) for index in range(20)]
    assert sum(params.object.mass_kg > onset_mass(params) for params in drawn) == 10


def test_a_kind_of_slip_takes_a_motion_that_can_provoke_it():
    config = evslip.load_config("complex", {**MIXED, "slip.kind": ["hold", "tilt", "translation"]})
    for index in range(30):
        params = evslip.draw(config, index)
        if params.slip.kind == "tilt":
            assert params.motion.kind == "pick_and_place"
        if params.slip.kind == "translation":
            assert params.motion.kind in ("pick_and_place", "hold")
    with pytest.raises(ConfigError, match=r"'tilt' needs motion\.kind pick_and_place"):
        evslip.draw(evslip.load_config("complex", {"slip.kind": "tilt", "motion.kind": ["hold", "shake"]}), 0)


def test_mixtures_are_shown(tmp_path, monkeypatch, capsys):
    config = evslip.load_config("complex", MIXED)
    assert "one of side, front" in draw_sheet(config, 0)
    write_distributions(tmp_path / "draws.png", config, {"train": 8, "test": 8})
    run(monkeypatch, "show", "complex", "--check-split", "--set", 'motion.kind=["hold","shake"]')
    assert "motion.kind" in capsys.readouterr().out


def test_a_data_set_of_all_mixtures_is_generated(tmp_path, monkeypatch, meshes):
    settings = {**MIXED, **TINY, "object.shape": ["cuboid", "mesh"], "object.mesh": meshes[:2], "sampling": "grid"}
    config = evslip.load_config("complex", {**settings, "test_share": 0.0})
    (tmp_path / "mixed.toml").write_text(dump_config(config))
    out = tmp_path / "data"
    run(monkeypatch, "generate", str(tmp_path / "mixed.toml"), str(out), "--count", "5", "--workers", "1")
    records = list(evslip.open_dataset(out))
    assert {record.kind for record in records} == {"simulated"}
    seen = {key: {value(record.params, key) for record in records if record.params} for key in LISTS}
    assert all(len(names) > 1 for names in seen.values())
    windows = evslip.open_dataset(out).windows()
    assert np.isfinite(windows.start_us).all()
