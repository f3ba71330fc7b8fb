"""The README's moving picture: one episode with the grip force left alone, and with a detector that sets it.

python examples/closed_loop_clip.py docs/figures/closed_loop.webp [--split train] [--index 3] [--model default-hold]

Shown at half speed, for a slip is over in a tenth of a second.
"""

import argparse
from collections import deque
from pathlib import Path
from typing import NamedTuple

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from evslip.control.candidates import Candidates
from evslip.control.controllers import make_controller
from evslip.control.controllers.controller import Setup
from evslip.control.controllers.slip_signal import MODEL
from evslip.control.picture import picture_of
from evslip.events.stream import concatenate

STEP_US, PICTURE_US, SLOWER = 10_000, 50_000, 2
LAST_MS = 1500
EVENTS_US = 20_000
PLOT_PX, SHOWN_S = 74, 8.0
INK, GREY, RED, ORANGE, BLUE = "#222222", "#bbbbbb", "#c0392b", "#e67e22", "#2471a3"


class Course(NamedTuple):
    """One episode, in pictures and in numbers."""

    pictures: list[np.ndarray]
    """Frames with the events of the last 20 ms, one every 0.05 s."""
    rows: np.ndarray
    """Time in seconds, force and least force in newtons, slip probability, angle in degrees; of shape (n, 5), a row a
    step."""
    lost: bool


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--split", default="train")
    parser.add_argument("--index", type=int, default=3)
    parser.add_argument("--model", default=MODEL)
    parser.add_argument("--seconds", type=float, default=SHOWN_S, help="most of the episode that is shown")
    options = parser.parse_args()
    candidates = Candidates("hold", split=options.split)
    shown = {}
    for title, controller in (
        ("grip force constant", make_controller("constant")),
        ("grip force by events", make_controller("detector", model=options.model)),
    ):
        shown[title] = played(candidates, options.index, controller, options.seconds)
    count = max(len(course.pictures) for course in shown.values())
    most_n = max(float(course.rows[:, 1:3].max()) for course in shown.values())
    longest_s = max(float(course.rows[-1, 0]) for course in shown.values())
    sheets = [
        np.hstack([panel(title, course, k, most_n, longest_s) for title, course in shown.items()]) for k in range(count)
    ]
    images = [Image.fromarray(sheet) for sheet in sheets]
    options.out.parent.mkdir(parents=True, exist_ok=True)
    shown_ms = [SLOWER * PICTURE_US // 1000] * (count - 1) + [LAST_MS]
    images[0].save(
        options.out, save_all=True, append_images=images[1:], duration=shown_ms, loop=0, quality=45, method=4
    )
    print(f"{options.out}: {count} pictures, {sum(shown_ms) / 1000} s, {options.out.stat().st_size / 1e6:.2f} MB")


def played(candidates: Candidates, index: int, controller, seconds: float) -> Course:
    """An episode that a controller plays, as far as it is shown."""
    episode = candidates.make(index, STEP_US, sees=True)
    low, high = candidates.forces_n
    size = candidates.size
    controller.reset(Setup(size, STEP_US, episode.start_us, episode.target_n, low, high))
    pictures, rows, recent = [], [], deque([episode.events], maxlen=EVENTS_US // STEP_US)
    while not episode.is_over and episode.t_us < episode.start_us + seconds * 1e6:
        force_n = controller.step(episode.events, episode.senses)
        episode.advance(episode.t_us + STEP_US, min(max(force_n, low), high))
        recent.append(episode.events)
        time_s = (episode.t_us - episode.start_us) / 1e6
        p_slip = np.nan if controller.answer is None else controller.answer.p_slip
        least_n = episode.truth.least_n if episode.truth.hangs else np.nan
        rows.append((time_s, episode.simulation.force_n, least_n, p_slip, episode.monitor.theta_deg))
        if len(rows) % (PICTURE_US // STEP_US) == 0:
            pictures.append(picture_of(episode.frame, concatenate(list(recent)), size))
    return Course(pictures, np.nan_to_num(np.array(rows), nan=-1.0), episode.is_lost)


def panel(title: str, course: Course, k: int, most_n: float, seconds: float) -> np.ndarray:
    """Picture k of a course, with its curves below; that of a lost object stays."""
    last = min(k, len(course.pictures) - 1)
    picture = Image.fromarray(course.pictures[last])
    width, height = picture.size
    sheet = Image.new("RGB", (width + 8, height + 2 * PLOT_PX + 28), "white")
    sheet.paste(picture, (4, 24))
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(13)
    row = course.rows[min((last + 1) * (PICTURE_US // STEP_US), len(course.rows)) - 1]
    is_gone = course.lost and k >= len(course.pictures) - 1
    state = "lost" if is_gone else f"turned by {row[4]:.1f}°"
    draw.text((6, 4), title, INK, font)
    draw.text((width, 4), state, RED if is_gone or row[4] > 5 else INK, font, anchor="ra")
    known = course.rows[course.rows[:, 0] <= row[0]]
    box = 4, height + 30, width - 1, PLOT_PX - 12
    curve(draw, font, box, known, 1, "force (least that holds), N", BLUE, most_n, seconds)
    curve(draw, font, box, known, 2, "", ORANGE, most_n, seconds)
    box = 4, height + 30 + PLOT_PX, width - 1, PLOT_PX - 12
    curve(draw, font, box, known, 3, "slip probability", RED, 1.0, seconds)
    return np.asarray(sheet)


def curve(draw, font, box, rows: np.ndarray, column: int, name: str, colour: str, most: float, seconds: float) -> None:
    """A column over time; what is below 0 is not known, and left out."""
    left, top, width, height = box
    draw.rectangle((left, top, left + width, top + height), outline=GREY)
    known = rows[rows[:, column] >= 0]
    x = left + known[:, 0] / seconds * width
    y = top + height * (1 - np.clip(known[:, column] / (1.05 * most), 0, 1))
    if len(known) > 1:
        draw.line(list(zip(x.tolist(), y.tolist(), strict=True)), colour, 2)
    if name:
        draw.text((left + 5, top + 2), name, GREY if len(known) < 2 else INK, font)


if __name__ == "__main__":
    main()
