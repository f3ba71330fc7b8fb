"""The command line as a user meets it: what is printed, exit codes, one line for what is wrong."""

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from command_line import Done, evslip
from evslip.cli import VERBS
from evslip.cli.doctor import OPTIONAL
from evslip.codecs import read_events, write_events
from evslip.config.loading import dump_config
from evslip.config.presets import PRESETS
from evslip.control.controllers import CONTROLLERS
from evslip.data import building
from evslip.events import Events, load_noise_map
from evslip.learn.shipped import NAMES
from sample_records import CONFIG, random_events

ROOT = Path(__file__).parents[2]


def assert_one_line(result: Done | subprocess.CompletedProcess, *words: str) -> None:
    assert result.returncode == 2, result.stderr
    assert "Traceback" not in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1, result.stderr
    assert all(word in result.stderr for word in words), result.stderr


def test_help_names_every_verb():
    result = evslip("--help")
    assert result.returncode == 0
    assert all(verb in result.stdout for verb in VERBS)


def test_a_process_of_its_own_says_the_same():
    for words in (["show", "simple"], ["show", "nope"]):
        command = [sys.executable, "-m", "evslip", *words]
        done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
        assert (done.returncode, done.stdout, done.stderr) == evslip(*words)
    assert_one_line(done, "nope", "complex")


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_explains_itself(verb):
    result = evslip(verb, "--help")
    assert result.returncode == 0
    words = " ".join(re.sub("[│╭╮╰╯─]", " ", result.stdout).split())
    assert words.startswith(f"usage: evslip {verb}")
    assert "default: None" not in words and "(default: )" not in words
    named = [f"`{name}`" in words for name in NAMES]
    assert any(named) == all(named), "of the detectors of the package, all or none"


def test_show_prints_a_configuration_that_loads_again(tmp_path):
    result = evslip("show", "complex", "--set", "object.mass_kg=0.05")
    assert result.returncode == 0
    path = tmp_path / "shown.toml"
    path.write_text(result.stdout)
    assert evslip("show", path).stdout == result.stdout
    assert '"mass_kg": 0.05' in evslip("show", path, "--index", 3, "--json").stdout


def test_show_prints_a_draw_with_units_and_its_onset():
    shown = evslip("show", "complex", "--index", 7, "--set", "object.mass_kg=0.005").stdout
    lines = {line.split()[0]: " ".join(line.split()[1:]) for line in shown.splitlines() if line}
    assert lines["object.mass_kg"] == "5 g"
    assert lines["grip.offset"].endswith("from -0.8 to 0.8")
    assert lines["object.width_m"].endswith("mm from 30 mm to 70 mm")
    assert lines["predicted"].startswith("onset") and " g, the least of lift" in lines["predicted"]
    assert lines["mass"].endswith("it holds")


def test_show_proves_that_the_splits_are_separate(tmp_path):
    result = evslip("show", "complex", "--check-split", "--count", 30, "--test-count", 20)
    assert result.returncode == 0
    assert ["object.mass_kg", "30", "20", "0"] in [line.split() for line in result.stdout.splitlines()]
    assert "textures: " in result.stdout
    plot = tmp_path / "plot.png"
    assert evslip("show", "demo", "--plot", plot, "--count", 10, "--test-count", 5).returncode == 0
    with Image.open(plot) as picture:
        assert picture.width > 1000


def test_show_makes_a_preset_of_biases(tmp_path):
    out = tmp_path / "sensitive.toml"
    result = evslip("show", "camera", "--biases", "OnBn=5/26", "OffBn=1.9e-9", "--out", out)
    assert result.returncode == 0 and "ON threshold" in result.stdout
    shown = evslip("show", "camera", out).stdout.splitlines()
    lines = {line.split()[0]: line.split()[1] for line in shown if len(line.split()) > 1 and not line.startswith(" ")}
    assert float(lines["theta_on"]) == pytest.approx(0.1196, abs=1e-4)
    assert float(lines["theta_off"]) == pytest.approx(0.0972, abs=1e-4)
    sets = evslip("show", "camera", "--biases").stdout
    assert "| default |" in sets and "| high sensitivity |" in sets


def test_show_writes_a_sheet_of_textures(tmp_path):
    Image.new("RGB", (30, 30), "red").save(tmp_path / "red.png")
    for name, count in (("wood-1", 1), ("tile-*", 9), (tmp_path, 1)):
        out = tmp_path / "sheets" / "sheet.png"
        result = evslip("show", "textures", name, "--out", out)
        assert result.returncode == 0 and f"{count} textures" in result.stdout
        with Image.open(out) as picture:
            assert picture.width >= 160 * count


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["show", "nope"], ["nope", "complex"]),
        (["show", "simple", "--set", "object.mas_kg=1"], ["object.mas_kg", "mass_kg"]),
        (["show", "simple", "--set", "object.mass_kg"], ["KEY=VALUE"]),
        (["generate", "simple", "OUT", "--count", 1, "--set", "object.mass_kg=-1"], ["object.mass_kg", "-1"]),
        (["generate", "simple", "OUT", "--count", 1, "--split", "test"], ["test_share"]),
        (["generate", "simple", "OUT", "--count", 1, "--set", "object.texture=nope"], ["object.texture", "nope"]),
        (["status", "OUT"], ["OUT"]),
        (["verify", "OUT"], ["OUT"]),
        (["windows", "OUT", "w.h5"], ["OUT"]),
        (["windows", "w.h5"], ["w.h5", "one or more data sets"]),
        (["train", "OUT/w.h5", "OUT/model"], ["w.h5"]),
        (["evaluate", "OUT/model", "OUT/w.h5"], ["OUT"]),
        (["report", "OUT"], ["OUT"]),
        (["events", "OUT", "OUT/e.h5", "--fps", 10], ["OUT"]),
        (["show", "camera", "davis"], ["davis", "davis346"]),
        (["show", "camera", "--biases", "OnBn=5/256"], ["OnBn", "0 to 255"]),
        (["show", "camera", "--biases", "OnBn"], ["OnBn", "NAME=COARSE/FINE"]),
        (["show", "camera", "davis346", "--out", "OUT/c.json"], ["c.json", ".toml"]),
        (["show", "simple", "davis346"], ["davis346", "show camera"]),
        (["show", "simple", "--check-split"], ["test_share"]),
        (["show", "complex", "--check-split", "--count", 0], ["count", "0"]),
        (["show", "complex", "--plot", "OUT/plot.txt"], ["plot.txt", ".png"]),
        (["show", "simple", "--index", -1], ["index", "-1"]),
        (["show", "textures", "wod-*", "--out", "OUT/sheet.png"], ["wod-*"]),
        (["show", "textures", "wood-1", "--out", "OUT/sheet.txt"], ["sheet.txt", ".png"]),
        (["calibrate", "OUT/r.h5", "OUT/noise.npz"], ["r.h5"]),
        (["calibrate", "OUT/r.h5", "OUT/noise.txt"], ["noise.txt", ".npz", ".toml"]),
        (["calibrate", "OUT/r.h5"], ["r.h5", "recordings, then the file"]),
        (["calibrate", "OUT/r.h5", "OUT/c.toml", "--start-s", 2, "--end-s", 1], ["start-s", "2"]),
        (["calibrate", "OUT/r.h5", "OUT/c.toml", "--seed", -1], ["seed: -1 is out of range"]),
        (["import", "OUT/r.aedat4", "OUT/r.h5"], ["r.aedat4"]),
        (["convert", "OUT/r.raw", "OUT/r.dat"], ["r.raw", "no such file"]),
        (["convert", "OUT/r.raw", "OUT/r.aedat"], ["r.aedat", "written", ".raw"]),
        (["info", "OUT/r.raw"], ["r.raw", "no such file"]),
        (["info", "OUT/r.mp4"], ["r.mp4", "known are"]),
        (["import", "OUT/r.raw", "OUT/r.h5", "--rotate", 45], ["--rotate"]),
        (["publish", "OUT/none", "OUT/new"], ["no such folder"]),
        (["convert", "OUT/r.raw", "OUT/r.dat", "--crop", 1, 2, 3], ["--crop: '1 2 3' given", "X Y WIDTH HEIGHT"]),
        (["convert", "OUT/r.mp4", "OUT/r.dat"], ["r.mp4", "read", ".aedat4"]),
        (["detect", "OUT/model", "OUT/r.h5"], ["OUT"]),
        (["detect", "default", "OUT/r.h5", "--out", "/dev/null/r"], ["cannot write /dev/null/r.csv", "is a file"]),
        (["evaluate", "default", "OUT", "--out", "/dev/null/e"], ["cannot write /dev/null/e/evaluation.html"]),
        (["windows", "OUT", "/dev/null/w.h5"], ["cannot write /dev/null/w.h5", "is a file"]),
        (["evaluate"], ["nothing", "expected one or more models"]),
        (["show", "simple", "--set", "object.finish=shiny"], ["object.finish: 'shiny' is unknown", "metal"]),
        (["trian"], ["'trian' is no verb", "train"]),
        (["train"], ["missing: WINDOWS, OUT", "`evslip train --help` explains"]),
        (["train", "--epoks", 3, "a", "b"], ["evslip: --epoks: not known here"]),
        (["train", "--epoks", 3], ["evslip: --epoks: not known here"]),
        (["train", "--epoks"], ["evslip: --epoks: not known here"]),
        (["train", "w.h5", "OUT", "--epoks", 3], ["--epoks: not known here"]),
        (["train", "w.h5", "OUT", "--epochs"], ["--epochs: nothing given", "whole number"]),
        (["train", "w.h5", "OUT", "--schedule=cyle"], ["--schedule", "'cyle'", "cycle, constant"]),
        (["train", "w.h5", "OUT", "--network", "nope"], ["'nope'", "cnn3d_bn"]),
        (["train", "w.h5", "OUT", "--model", "nope"], ["'nope'", "cnn3d_bn"]),
        (["sweep", "w.h5", "OUT", "--model", "nope"], ["'nope'", "cnn3d_bn"]),
        (["realism", "OUT", "--preset", "clean"], ["OUT: no format of events"]),
        (["convert", "OUT", "a.h5", "--slice", 0, 1, "--end-s", 1], ["either --slice, or --start-s and --end-s"]),
        (["windows", "OUT", "w.h5", "--hold-deg", 5], ["hold_deg 5"]),
        (["publish", "OUT", "OUT/new", "--shard-mb", 0], ["shard_mb"]),
    ],
)
def test_what_is_wrong_is_said_in_one_line_and_leaves_nothing(arguments, words, tmp_path):
    out = tmp_path / "OUT"
    result = evslip(*(str(a).replace("OUT", str(out)) for a in arguments))
    assert_one_line(result, *words)
    assert not out.exists()


def test_a_part_of_the_time_is_converted_by_its_ends_or_both_at_once(tmp_path):
    events = random_events(np.random.default_rng(0), 500, labelled=False)
    write_events(tmp_path / "a.csv", events, (40, 30))
    first, last = int(events.t_us[0]), int(events.t_us[-1])
    half = (last - first) / 2e6
    ways = (["--slice", 0.001, half], ["--start-s", 0.001, "--end-s", half], ["--end-s", half], ["--start-s", 0.001])
    made = []
    for number, words in enumerate(ways):
        result = evslip("convert", tmp_path / "a.csv", tmp_path / f"{number}.csv", *words)
        assert result.returncode == 0, result.stderr
        made.append(read_events(tmp_path / f"{number}.csv"))
    both, apart, until, since = made
    assert both == apart and 0 < both.count < events.count
    assert since.t_us[0] == both.t_us[0] and since.t_us[-1] == last
    assert until.t_us[0] == first and until.t_us[-1] == both.t_us[-1]


def test_show_prints_a_camera_with_units():
    shown = evslip("show", "camera", "davis346").stdout
    assert ["cutoff_hz", "15", "Hz"] in [line.split()[:3] for line in shown.splitlines()]
    assert max(map(len, shown.splitlines())) <= 110
    assert "| theta | ln | 0.15 |" in evslip("show", "camera").stdout


def test_a_sensors_noise_is_measured_and_used_again(tmp_path):
    # Two seconds of a still scene: one pixel fires ON at 50 Hz, another OFF at 20 Hz.
    times = np.concatenate([np.arange(100) * 20_000, np.arange(40) * 50_000 + 7])
    order = np.argsort(times, kind="stable")
    on = np.arange(140) < 100
    events = Events(times, np.where(on, 3, 5).astype(np.uint16), np.where(on, 1, 2).astype(np.uint16), on)
    write_events(tmp_path / "still.h5", events.select(order), (8, 6))
    result = evslip("calibrate", tmp_path / "still.h5", tmp_path / "noise.npz")
    assert result.returncode == 0, result.stderr
    assert "busiest" in result.stdout
    assert load_noise_map(tmp_path / "noise.npz")[:, (1, 2), (3, 5)].round().tolist() == [[50, 0], [0, 20]]
    part = tmp_path / "part.npz"
    assert evslip("calibrate", tmp_path / "still.h5", part, "--start-s", 1.5).returncode == 0
    assert not np.array_equal(load_noise_map(part), load_noise_map(tmp_path / "noise.npz"))
    assert_one_line(evslip("calibrate", tmp_path / "still.h5", tmp_path / "n.npz", "--each-pixel"), "each-pixel: ")
    assert_one_line(evslip("calibrate", tmp_path / "still.h5", tmp_path / "n.npz", "--start-s", 9), "no events between")
    (tmp_path / "frames").mkdir()
    for number in range(3):
        Image.new("L", (8, 6), 100).save(tmp_path / "frames" / f"{number}.png")
    arguments = ["events", tmp_path / "frames", tmp_path / "e.h5", "--fps", 0.2, "--camera", "clean"]
    assert evslip(*arguments, "--noise-map", tmp_path / "noise.npz").returncode == 0
    noisy = read_events(tmp_path / "e.h5")
    assert set(zip(noisy.x.tolist(), noisy.y.tolist(), noisy.p.tolist(), strict=True)) == {(3, 1, True), (5, 2, False)}
    assert noisy.count == pytest.approx(700, abs=4 * 700**0.5)
    (tmp_path / "noise.npz").write_bytes(b"PK no zip")
    assert_one_line(evslip(*arguments, "--noise-map", tmp_path / "noise.npz"), "noise.npz")


def test_an_empty_folder_is_no_data_set_no_frames_no_model(tmp_path):
    assert_one_line(evslip("status", tmp_path), str(tmp_path))
    assert_one_line(evslip("events", tmp_path, tmp_path / "e.h5", "--fps", 10), str(tmp_path))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("verb", ["generate", "show", "warm-up"])
def test_help_names_every_preset(verb):
    assert ", ".join(PRESETS) in re.sub(r"[│\s]+", " ", evslip(verb, "--help").stdout)


@pytest.mark.parametrize("verb", ["play", "control"])
def test_help_names_every_controller(verb):
    *most, last = CONTROLLERS
    assert f"{', '.join(most)} or {last}" in re.sub(r"[│\s]+", " ", evslip(verb, "--help").stdout)


def test_doctor_names_packages_and_disk():
    result = evslip("doctor", "--count", 10)
    assert result.returncode == 0
    assert "mujoco" in result.stdout
    assert "10 samples need about 0.1 GB" in result.stdout
    assert "ok       opencv-python-headless" in result.stdout  # imported as cv2


def test_doctor_refuses_fewer_than_one_sample():
    assert_one_line(evslip("doctor", "--count=-5"), "count: -5")


def test_doctor_knows_every_extra():
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    assert {extra for _, extra in OPTIONAL.values()} == set(extras) - {"dev", "docs"}


def test_a_recording_is_converted(tmp_path):
    rng = np.random.default_rng(0)
    write_events(tmp_path / "a.npz", random_events(rng, 300), (40, 30))
    result = evslip("convert", tmp_path / "a.npz", tmp_path / "a.raw", "--crop", 8, 6, 20, 10, "--polarity", "on")
    assert result.returncode == 0, result.stderr
    assert "100% ON, 20x10" in result.stdout
    assert "note: a.raw does not hold the labels" in result.stdout
    assert evslip("import", tmp_path / "a.raw", tmp_path / "a.h5").returncode == 0
    assert read_events(tmp_path / "a.h5").count == read_events(tmp_path / "a.raw").count > 0


def test_a_recording_is_looked_into_labelled_windowed_and_published(tmp_path):
    events = random_events(np.random.default_rng(0), 5000, (346, 260), labelled=False)
    events = events.replace(t_us=np.sort(np.random.default_rng(1).integers(0, 1_000_000, 5000)))
    write_events(tmp_path / "a.aedat4", events, (346, 260))
    shown = evslip("info", tmp_path / "a.aedat4")
    assert shown.returncode == 0
    assert "346 x 260 pixels (as stated)" in shown.stdout and "5,000" in shown.stdout
    facts = json.loads(evslip("info", tmp_path / "a.aedat4", "--json").stdout)
    assert (facts["count"], facts["disorder"], facts["size"]) == (5000, 0, [346, 260])
    (tmp_path / "l.csv").write_text("0,0.4,hold\n0.4,0.9,slip\n")
    record = tmp_path / "records" / "a.h5"
    made = evslip("import", tmp_path / "a.aedat4", record, "--labels", tmp_path / "l.csv", "--mount", "side")
    assert made.returncode == 0, made.stderr
    assert "2 labelled intervals" in made.stdout
    assert "side" in evslip("info", record).stdout
    cut = evslip("windows", record.parent, tmp_path / "w.h5", "--no-balance", "--vt-snn", tmp_path / "vt")
    assert "5 windows (3 slip, 2 hold" in cut.stdout
    assert len(list((tmp_path / "vt" / "prophesee_recordings").iterdir())) == 5
    assert evslip("import", tmp_path / "vt", tmp_path / "back").stdout.strip().endswith("5 records")
    assert evslip("publish", record.parent, tmp_path / "out", "--webdataset").returncode == 0
    assert (tmp_path / "out" / "data" / "recordings-00000.tar").is_file()


def test_no_verb_writes_over_what_it_reads_or_over_a_record(tmp_path):
    a, b, c = (tmp_path / name for name in ("a.h5", "b.h5", "c.csv"))
    write_events(c, random_events(np.random.default_rng(0), 300, labelled=False), (40, 30))
    labels = tmp_path / "l.csv"
    labels.write_text("0,0.04,hold\n")
    for record in (a, b):
        assert evslip("import", c, record, "--labels", labels).returncode == 0
    link = tmp_path / "link.h5"
    link.symlink_to(a)
    before = {path: path.read_bytes() for path in (a, b, c, labels)}
    for words in (
        ("windows", a, a),
        ("windows", b, a, link),
        ("report", a, "--out", a),
        ("report", a, "--compare", c, "--out", c),
        ("report", a, "--windows", b, "--out", b),
        ("import", a, a),
        ("info", c, "--hot", c),
        ("convert", a, labels, "--without", labels),
        ("calibrate", c, c),
        ("realism", a, b, "--out", b),
        ("realism", a, b, "--json", a),
    ):
        assert_one_line(evslip(*words), "is the file that is read")
    assert_one_line(evslip("windows", a, b), "b.h5: is there already, and no file of windows")
    assert before == {path: path.read_bytes() for path in before}
    for _ in range(2):
        assert evslip("windows", a, tmp_path / "w.h5", "--no-balance", "--length-s", 0.01).returncode == 0


def test_windows_replace_nothing_else_and_check_every_folder_before_they_cut(tmp_path):
    record, notes, out = tmp_path / "set" / "a.h5", tmp_path / "notes.txt", tmp_path / "w.h5"
    write_events(tmp_path / "c.csv", random_events(np.random.default_rng(0), 300, labelled=False), (40, 30))
    (tmp_path / "l.csv").write_text("0,0.04,hold\n")
    assert evslip("import", tmp_path / "c.csv", record, "--labels", tmp_path / "l.csv").returncode == 0
    notes.write_text("mine")
    assert_one_line(evslip("windows", record, notes, "--length-s", 0.01), "notes.txt: is there already")
    assert notes.read_text() == "mine"
    (tmp_path / "vt" / "prophesee_recordings").mkdir(parents=True)
    (tmp_path / "vt" / "prophesee_recordings" / "rotate_01_td.mat").write_text("mine")
    for folder, words in ((tmp_path / "vt", "expected a new folder"), (notes, "a parent of it is a file")):
        assert_one_line(evslip("windows", record, out, "--length-s", 0.01, "--vt-snn", folder), words)
        assert not out.exists()


def test_windows_are_not_put_among_the_samples(tmp_path):
    root = tmp_path / "ds"
    building.create(root, dump_config(CONFIG))
    for name in ("samples/w.h5", "journal/w.h5", "plan-test.json"):
        assert_one_line(evslip("windows", root, root / name), "among the data set's own files")
    for option in ("--vt-snn", "--visualize"):
        assert_one_line(evslip("windows", root, tmp_path / "w.h5", option, root), "is the data set's own folder")
        assert_one_line(evslip("windows", root, tmp_path / "w.h5", option, root / "samples/v"), "data set's own files")
    assert [path.name for path in root.iterdir()] == ["config.toml"]


def test_a_seed_out_of_range_is_told_in_all_digits():
    said = evslip("show", "demo", "--set", f"seed={2**63}")
    assert_one_line(said, f"seed: {2**63} is out of range, expected 0 to {2**63 - 1}")
    assert_one_line(evslip("show", "demo", "--set", "object.mass_kg=0.0000001"), "mass_kg: 1e-07 is out of range")
