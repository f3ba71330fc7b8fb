"""The pages in a real browser."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import evslip
from evslip.config.loading import dump_config
from evslip.data import building, dataset, record_file
from evslip.data.intervals import Interval, read_intervals
from evslip.physics.truth import measure
from evslip.view.explorer.labels import Labels
from evslip.view.explorer.shelf import open_recording, open_shelf
from sample_records import CONFIG, random_events, simulated

pytestmark = pytest.mark.slow

COLOURED = """() => {
    const canvas = document.getElementById("stage");
    const pixels = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
    let count = 0;
    for (let at = 0; at < pixels.length; at += 4) count += pixels[at] !== pixels[at + 2];
    return count;
}"""
"""How many pixels of the stage are not grey."""


@pytest.fixture
def samples(tmp_path: Path) -> Path:
    root = tmp_path / "data"
    building.create(root, dump_config(CONFIG))
    for index in range(4):
        sample = simulated(index, "train", steps=100)
        building.add(root, sample, record_file.encode(sample))
    return root


def test_the_list_filters_sorts_and_completes(open_page, samples: Path):
    page = open_page(open_shelf(samples))
    page.wait_for_selector("body[data-complete]")

    def names() -> list[str]:
        return [row.split("\t")[0] for row in page.inner_text("#rows").splitlines()]

    assert names() == [f"train/{index:07d}" for index in range(4)]
    page.select_option("#label", "slip")
    assert names() == ["train/0000000", "train/0000003"]
    page.select_option("#label", "")
    page.get_by_role("button", name="mass, g").click()
    masses = [float(row.split("\t")[4]) for row in page.inner_text("#rows").splitlines()]
    assert masses == sorted(masses, reverse=True)
    page.fill("#filter", "no such thing")
    assert page.inner_text("#count") == "0 of 4 samples"
    page.fill("#filter", "")
    page.check("#doubtful")  # the made-up records' poses are noise
    doubtful = page.inner_text("#rows").splitlines()
    assert all("but is called" in row.split("\t")[2] for row in doubtful)
    assert page.inner_text("#doubts") == f"({len(doubtful)})"


@pytest.fixture
def moving(tmp_path: Path) -> Path:
    """A data set of one simulated motion, whose frames can be drawn; its events are made up."""
    params = evslip.draw(CONFIG, 0, "train")
    trajectory = evslip.simulate(params)
    truth = measure(trajectory)
    events = random_events(np.random.default_rng(0), 500)
    events = events.replace(t_us=events.t_us + truth.span_us[0])
    root = tmp_path / "moving"
    building.create(root, dump_config(CONFIG))
    sample = dataclasses.replace(simulated(0), params=params, trajectory=trajectory, truth=truth, events=events)
    building.add(root, sample, record_file.encode(sample))
    return root


@pytest.mark.parametrize("size", [(1280, 800), (390, 844)])
def test_a_sample_plays_and_is_scrubbed(open_page, moving: Path, size: tuple[int, int]):
    page = open_page(open_shelf(moving), size=size)
    sample = dataset.open_dataset(moving)[0]
    assert sample.truth is not None
    start, events = sample.truth.span_us[0], sample.events
    page.get_by_role("link", name="train/0000000").click()
    page.wait_for_selector("#now:has-text('events in 10 ms')")
    page.keyboard.press("Home")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowRight")
    page.wait_for_selector(f"#now:has-text('{start / 1e6 + 0.02:.4f} s')")
    last = events.between(start + 10_000, start + 20_000)
    page.wait_for_selector(f"#now:has-text('{last.count} events')")
    page.select_option("#view", "events")
    page.wait_for_timeout(100)
    assert page.evaluate(COLOURED) == len(set(zip(last.x, last.y, strict=True)))
    page.select_option("#view", "frame")
    page.wait_for_timeout(500)
    assert page.evaluate(COLOURED) == 0
    page.keyboard.press("+")
    assert page.input_value("#speed") == "0.2"
    page.keyboard.press("End")
    for _ in range(5):
        page.keyboard.press("ArrowLeft")
    page.keyboard.press("Space")
    page.wait_for_selector("#play:has-text('pause')")
    page.wait_for_selector("#play:has-text('play')", timeout=20_000)  # to the end
    assert page.evaluate("document.documentElement.scrollWidth") <= size[0]
    box = page.locator("#charts").bounding_box()
    page.mouse.click(box["x"] + 66 + 0.5 * (box["width"] - 76), box["y"] + 30)
    middle = sum(sample.truth.span_us) / 2e6
    page.wait_for_selector(f"#now:has-text('{middle:.1f}')")
    page.wait_for_selector("#stage[data-complete]:not([data-complete=''])")
    at = float(page.get_attribute("#stage", "data-complete"))
    assert at / 1e6 == pytest.approx(middle, abs=0.1)  # what is seen is all of that moment
    head = page.locator("#playhead").bounding_box()
    assert head["x"] == pytest.approx(box["x"] + 66 + 0.5 * (box["width"] - 76), abs=2)


def test_a_curve_of_an_hour_is_drawn(open_page, samples: Path):
    page = open_page(open_shelf(samples))
    page.evaluate("""async () => {
        const {Charts} = await import("/static/chart.js");
        const holder = document.body.appendChild(document.createElement("div"));
        holder.innerHTML = "<canvas></canvas><div></div>";
        const t_us = Array.from({length: 300_000}, (_, i) => i);
        const curves = [{name: "slip", unit: "", t_us, lines: {p: t_us}}];
        const about = {curves, start_us: 0, end_us: 3e5, origin_us: 0, held: [], slips: [], phases: []};
        new Charts(holder.firstChild, about, {t: 0}).draw();
    }""")


def test_three_intervals_are_labelled_and_found_again(open_page, recording: Path, tmp_path: Path):
    path = tmp_path / "labels.csv"
    page = open_page(open_recording(recording), Labels(path))
    page.wait_for_selector("body[data-ready]")
    page.keyboard.press("Home")
    # With the keyboard alone: from 0 to 10 ms slip, from 20 to 30 hold, from 30 to 40 slip.
    for keys in (["s", 1, "s", 1, "h", 1, "h", "s", 1, "s"],):
        for key in keys:
            page.keyboard.press(key if isinstance(key, str) else "ArrowRight")
    page.wait_for_selector("#saved:has-text('saved in labels.csv')")
    wanted = (Interval(0, 10_000, "slip"), Interval(20_000, 30_000, "hold"), Interval(30_000, 40_000, "slip"))
    assert read_intervals(path) == wanted
    page.keyboard.press("u")
    page.wait_for_selector("#hint:has-text('2 intervals')")
    page.keyboard.press("r")
    page.wait_for_selector("#hint:has-text('3 intervals')")
    page.wait_for_selector("#saved:has-text('saved in labels.csv')")
    page.reload()
    page.wait_for_selector("#hint:has-text('3 intervals')")
    page.keyboard.press("Home")
    page.keyboard.press("]")
    page.wait_for_selector("#now:has-text('0.0100 s')")
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("d")
    page.wait_for_selector("#hint:has-text('2 intervals')")
    page.wait_for_selector("#saved:has-text('saved in labels.csv')")
    assert read_intervals(path) == wanted[1:]


def test_a_new_interval_cuts_the_old(open_page, recording: Path, tmp_path: Path):
    page = open_page(open_recording(recording), Labels(tmp_path / "labels.csv"))
    page.wait_for_selector("body[data-ready]")
    insert = """async ([old, added]) => (await import("/static/labels.js")).insert(old, added)"""
    old = [[0, 1, "hold"], [2, 3, "slip"]]
    for added, expected in (
        ([0.25, 0.5, "slip"], [[0, 0.25, "hold"], [0.25, 0.5, "slip"], [0.5, 1, "hold"], [2, 3, "slip"]]),
        ([0.5, 2.5, "hold"], [[0, 0.5, "hold"], [0.5, 2.5, "hold"], [2.5, 3, "slip"]]),
        ([1, 2, "slip"], [[0, 1, "hold"], [1, 2, "slip"], [2, 3, "slip"]]),
        ([-1, 4, "slip"], [[-1, 4, "slip"]]),
    ):
        assert page.evaluate(insert, [old, added]) == expected
