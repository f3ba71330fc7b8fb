"""Keys, colours, counts and saving of the pages, in a real browser."""

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from evslip.data import record_file
from evslip.data.intervals import Interval, read_intervals
from evslip.data.record import Record
from evslip.events.stream import Events
from evslip.view.explorer.labels import Labels
from evslip.view.explorer.shelf import open_recording
from sample_records import random_events

pytestmark = pytest.mark.slow

STRIPS = """async (curves) => {
    const {Charts} = await import("/static/chart.js"), {color} = await import("/static/page.js");
    const holder = document.body.appendChild(document.createElement("div"));
    holder.innerHTML = "<canvas></canvas><div></div>";
    const texts = [], shades = [], proto = CanvasRenderingContext2D.prototype, {fillText, stroke} = proto;
    proto.fillText = function(text) { texts.push([text, this.fillStyle]); };
    proto.stroke = function() { shades.push(this.strokeStyle); };
    const about = {curves, start_us: 0, end_us: 100, origin_us: 0, held: [], slips: [], phases: []};
    new Charts(holder.firstChild, about, {t: 0}).draw();
    Object.assign(proto, {fillText, stroke});
    return {texts, shades, on: color("--on"), off: color("--off")};
}"""
"""The texts of some curves with their colours, and the colours of their lines."""


def label_page(open_page, recording: Path, **given):
    page = open_page(open_recording(recording), Labels(recording.with_name("labels.csv")), **given)
    page.wait_for_selector("body[data-ready]")
    page.keyboard.press("Home")
    return page


def mark(page, key: str) -> None:
    """An interval of the next 10 ms."""
    for pressed in (key, "ArrowRight", key):
        page.keyboard.press(pressed)


def hold(page, key: str, times: int) -> None:
    """Chromium repeats a key that is pressed again before it was let go."""
    for _ in range(times):
        page.keyboard.down(key)
    page.keyboard.up(key)


def test_a_second_page_cannot_overwrite_the_labels_of_the_first(serve, visit, recording: Path, complaints: list[str]):
    path = recording.with_name("labels.csv")
    url = serve(open_recording(recording), Labels(path)).url
    first, second = visit(url), visit(url)
    for page in (first, second):
        page.wait_for_selector("body[data-ready]")
        page.keyboard.press("Home")
    mark(first, "s")
    first.wait_for_selector("#saved:has-text('saved in labels.csv')")
    mark(first, "h")
    first.wait_for_selector("#saved:has-text('saved in labels.csv')")
    wanted = (Interval(0, 10_000, "slip"), Interval(10_000, 20_000, "hold"))
    mark(second, "h")
    second.wait_for_selector("#problem:has-text('changed elsewhere')")
    assert "load the page anew" in second.inner_text("#problem")
    assert second.inner_text("#saved") == "not saved" and second.is_hidden("#unsaved")
    assert read_intervals(path) == wanted
    second.on("dialog", lambda dialog: dialog.accept())
    second.reload()
    second.wait_for_selector("#hint:has-text('2 intervals')")
    second.keyboard.press("Home")
    second.keyboard.press("d")
    second.wait_for_selector("#saved:has-text('saved in labels.csv')")
    assert read_intervals(path) == wanted[1:]
    assert ["409" in text for text in complaints] == [True]
    complaints.clear()


def test_labels_made_after_the_programs_end_are_saved_when_it_is_back(
    serve, visit, recording: Path, complaints: list[str]
):
    path = recording.with_name("labels.csv")
    server = serve(open_recording(recording), Labels(path))
    page = visit(server.url)
    page.wait_for_selector("body[data-ready]")
    page.keyboard.press("Home")
    mark(page, "s")
    page.wait_for_selector("#saved:has-text('saved in labels.csv')")
    server.stop()
    mark(page, "h")
    page.wait_for_selector("#unsaved:visible")
    assert "The program has ended" in page.inner_text("#unsaved")
    assert page.inner_text("#saved") == "not saved"
    assert "fetch" not in page.inner_text("body")
    again = serve(open_recording(recording), Labels(path), server.port)
    page.click("#again")
    page.wait_for_selector("#saved:has-text('saved in labels.csv')")
    assert page.is_hidden("#unsaved")
    wanted = (Interval(0, 10_000, "slip"), Interval(10_000, 20_000, "hold"))
    assert read_intervals(path) == wanted
    again.stop()
    mark(page, "s")
    page.wait_for_selector("#unsaved:visible")
    serve(open_recording(recording), Labels(path), server.port)
    mark(page, "h")
    page.wait_for_selector("#saved:has-text('saved in labels.csv')")
    assert len(read_intervals(path)) == 4
    assert all("ERR_CONNECTION" in text for text in complaints)
    complaints.clear()


def test_a_held_key_counts_once_but_arrows_go_on(open_page, recording: Path):
    page = label_page(open_page, recording)
    page.keyboard.press("Space")
    hold(page, "s", 5)
    hold(page, "h", 4)  # once, too: an interval of hold is begun
    assert page.get_attribute("#hold", "aria-pressed") == "true"
    assert page.locator("#intervals tr").count() == 0
    page.keyboard.press("Escape")
    page.wait_for_selector("#play:has-text('pause')")
    hold(page, "Space", 5)
    page.wait_for_selector("#play:has-text('play')")
    page.keyboard.press("Home")
    hold(page, "ArrowRight", 3)
    page.wait_for_selector("#now:has-text('0.0300 s')")
    page.focus("#slip")
    hold(page, "Enter", 5)
    assert page.get_attribute("#slip", "aria-pressed") == "true"


def test_letters_count_with_caps_lock(open_page, recording: Path):
    page = label_page(open_page, recording)
    mark(page, "S")
    page.wait_for_selector("#saved:has-text('saved in labels.csv')")
    assert page.inner_text("#hint") == "1 intervals"


def test_a_button_in_focus_is_pressed_by_its_keys(open_page, recording: Path):
    page = label_page(open_page, recording)
    for key, pressed in (("Space", "true"), ("Enter", "false"), ("Space", "true")):
        page.focus("#slip")
        page.keyboard.press(key)
        assert page.get_attribute("#slip", "aria-pressed") == pressed
        assert page.inner_text("#play") == "play"
    page.click("#slip")  # with the mouse: keys are the player's
    page.keyboard.press("Space")
    page.wait_for_selector("#play:has-text('pause')")
    assert page.get_attribute("#slip", "aria-pressed") == "false"


def test_a_list_is_gone_through_with_the_keyboard(open_page, recording: Path):
    page = label_page(open_page, recording)
    page.focus("#speed")
    for _ in range(2):
        page.keyboard.press("ArrowDown")
    assert page.input_value("#speed") == "0.5"
    assert page.evaluate("document.activeElement.id") == "speed"
    page.select_option("#window", "5")  # as with the mouse
    page.evaluate("document.activeElement.blur()")
    page.keyboard.press("+")
    assert page.input_value("#speed") == "1"


def test_events_that_were_not_sent_are_counted(open_page, tmp_path: Path):
    rng, count = np.random.default_rng(0), 600_000
    t_us = np.sort(rng.integers(0, 100_000, count))
    x, y = rng.integers(0, 20, (2, count)).astype(np.uint16)
    events = Events(t_us, x, y, rng.random(count) < 0.5)
    record_file.write(tmp_path / "r.h5", Record(kind="recording", name="r", size=(40, 30), events=events))
    page = label_page(open_page, tmp_path / "r.h5")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowRight")
    page.wait_for_selector("#now:has-text('0.0200 s, about')")
    shown = int(page.inner_text("#now").split("about ")[1].split(" events")[0].replace(",", ""))
    first_us = int(t_us[0])
    assert shown == pytest.approx(events.between(first_us + 10_000, first_us + 20_000).count, rel=1e-3)


def test_few_events_are_counted_exactly(open_page, recording: Path):
    page = label_page(open_page, recording)
    page.keyboard.press("ArrowRight")
    page.wait_for_selector("#now:has-text('events in 10 ms')")
    assert "about" not in page.inner_text("#now")


def test_curves_name_their_lines_in_the_colours_of_the_picture(open_page, recording: Path):
    page = label_page(open_page, recording)
    t_us, zero, some = [0, 50, 100], [0, 0, 0], [0, 1, 2]
    events = {"name": "events", "unit": "1000/s", "t_us": t_us, "lines": {"ON": zero, "OFF": zero}}
    pads = {"name": "pad force", "unit": "N", "t_us": t_us, "lines": {"pad 1": some, "pad 2": some}}
    alone = {"name": "turned", "unit": "deg", "t_us": t_us, "lines": {"theta": [-2, -1, -1]}}
    drawn = page.evaluate(STRIPS, [events, pads, alone])
    assert drawn["shades"][:2] == [drawn["on"], drawn["off"]]
    texts = [text for text, _ in drawn["texts"]]
    assert ["ON", drawn["on"]] in drawn["texts"] and ["OFF", drawn["off"]] in drawn["texts"]
    assert "pad 1" in texts and "pad 2" in texts and "theta" not in texts
    assert texts[:2] == ["1", "0"] and "1e-9" not in texts and "-2" in texts


def test_a_small_picture_shows_every_event(open_page, tmp_path: Path):
    """Also of a sensor that has many more pixels."""
    x, y = (axis.ravel().astype(np.uint16) for axis in np.meshgrid(np.arange(20, 1280, 77), np.arange(20, 720, 77)))
    events = Events(np.arange(x.size), x, y, np.arange(x.size) % 2 == 0)
    record_file.write(tmp_path / "r.h5", Record(kind="recording", name="r", size=(1280, 720), events=events))
    page = label_page(open_page, tmp_path / "r.h5", size=(390, 844))
    page.keyboard.press("End")
    page.wait_for_selector("#stage[data-complete]:not([data-complete=''])")
    page.wait_for_timeout(200)
    with Image.open(io.BytesIO(page.locator("#stage").screenshot())) as image:
        picture = np.asarray(image.convert("RGB")).astype(int)
    scale = (picture.shape[1] - 2) / 1280  # the border is 1 wide
    colourful = np.ptp(picture, axis=2) > 100
    # The last event may lie at the end of the time that is shown, which does not belong to it.
    places = [(1 + round(v * scale), 1 + round(u * scale)) for u, v in zip(x[:-1], y[:-1], strict=True)]
    assert len(places) > 100
    assert all(colourful[max(v - 1, 0) : v + 3, max(u - 1, 0) : u + 3].any() for v, u in places)


@pytest.mark.parametrize(("size", "rendering"), [((390, 844), "auto"), ((1280, 800), "pixelated")])
def test_only_an_enlarged_picture_shows_its_pixels(open_page, tmp_path: Path, size: tuple[int, int], rendering: str):
    """A small one, which has fewer pixels than the sensor, would lose events."""
    large = size[0] < 500
    sensor = (1280, 720) if large else (40, 30)
    events = random_events(np.random.default_rng(0), 500, sensor, labelled=False)
    record_file.write(tmp_path / "r.h5", Record(kind="recording", name="r", size=sensor, events=events))
    page = label_page(open_page, tmp_path / "r.h5", size=size)
    page.wait_for_timeout(100)
    assert page.evaluate("getComputedStyle(document.getElementById('stage')).imageRendering") == rendering
