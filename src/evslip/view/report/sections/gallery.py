"""All samples as cards that can be sorted and filtered."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from PIL import Image

from evslip.data.record import Record
from evslip.data.samples import Samples
from evslip.events.overlay import overlay
from evslip.utils.progress import over
from evslip.view.pictures.frame_source import FrameSource
from evslip.view.pictures.images import encoded, jpeg_uri
from evslip.view.report import page
from evslip.view.report.sections.names import short, swatch
from evslip.view.report.sections.strips import SHOWN_US, Pictures
from evslip.view.report.survey import Surveyed, spread

WIDTH = 160
"""Width of a thumbnail, in pixels."""
ORDERS = {
    "position": "order of the data set",
    "mass": "mass",
    "onset": "mass from which it slips",
    "ratio": "mass / that mass",
    "events": "events",
    "turned": "degrees turned",
    "slid": "mm slid",
}


def gallery(dataset: Samples, found: Sequence[Surveyed], pictures: Pictures, most_pictures: int) -> str:
    """A card for each sample; pictures of at most so many, evenly. Raises DataError."""
    if not found:
        return ""
    chosen = over("pictures", spread(list(found), most_pictures))
    drawn = {s.position: thumbnail(dataset.read(s.position, events=not s.split), pictures) for s in chosen}
    cards = "".join(_card(sample, drawn.get(sample.position)) for sample in found)
    moment = "as its object is about to be put down" if found[0].split else "in its middle"
    note = f"Every sample {moment}."
    doubtful = sum(bool(sample.doubt) for sample in found)
    if doubtful:
        note += f" {doubtful} of them {'is' if doubtful == 1 else 'are'} doubtful: the label contradicts the movement."
    if len(drawn) < len(found):
        note += f" Pictures of {len(drawn)} of the {len(found):,}; --pictures asks for more."
    return page.section("Samples", note, f'{_controls(found)}<div class="gallery">{cards}</div>')


def thumbnail(record: Record, pictures: Pictures) -> str:
    """A small JPEG as a URI: the end of the held time, or of a recording a frame or events in its middle."""
    if record.trajectory is not None and record.truth is not None:
        held = np.flatnonzero(record.truth.held)
        t_us = int(record.truth.t_us[held[-1]]) if len(held) else record.truth.span_us[1]
        (image,) = pictures(record.trajectory, np.array([t_us], np.int64))
    else:
        times = record.events.t_us
        t_us = int(times[len(times) // 2]) if len(times) else 0
        image = FrameSource(record).at_or_white(t_us)
        if record.footage is None:
            image = overlay(image, record.events.between(t_us - SHOWN_US, t_us))
    height = max(1, round(WIDTH * image.shape[0] / image.shape[1]))
    small = np.asarray(Image.fromarray(image).resize((WIDTH, height), Image.Resampling.BOX))
    return jpeg_uri(encoded(small, "JPEG", quality=82))


def _card(sample: Surveyed, image: str | None) -> str:
    facts = sample.facts
    keys: dict[str, Any] = {"position": sample.position, "events": sample.events}
    lines = [f"{short(sample.events).strip()} events"]
    if sample.params is not None:
        mass, onset = 1e3 * facts["mass_kg"], 1e3 * facts["onset_mass_kg"]
        turned, slid = facts["turned_deg"], facts["slid_mm"]
        keys |= {"mass": mass, "onset": onset, "ratio": mass / onset, "turned": turned, "slid": slid}
        lines = [
            f"{mass:.3g} g, slips from {onset:.3g} g",
            f"turned {turned:.2g}°, slid {slid:.2g} mm",
            f"{lines[0]}, {facts['shape']}, {facts['motion']}",
        ]
    elif "seconds" in facts:
        lines.append(f"{facts['seconds']:.2f} s")
    data = "".join(f' data-{key}="{value:.6g}"' for key, value in keys.items())
    words = page.text(f"{sample.name} {facts.get('shape', '')} {facts.get('motion', '')} {facts.get('texture', '')}")
    doubt = f'<br><span class="warn">{page.text(sample.doubt)}</span>' if sample.doubt else ""
    head = f"{swatch(sample.label)}<b>{page.text(sample.name)}</b> {page.text(sample.label)}"
    img = f'<img loading="lazy" src="{image}" alt="{page.text(sample.name)}">' if image else ""
    return (
        f'<figure data-label="{page.text(sample.label)}" data-split="{page.text(sample.split)}" '
        f'data-doubt="{"yes" if sample.doubt else ""}" data-words="{words.lower()}"{data}>{img}'
        f"<figcaption>{head}<br>{'<br>'.join(map(page.text, lines))}{doubt}</figcaption></figure>"
    )


def _controls(found: Sequence[Surveyed]) -> str:
    orders = {
        key: title for key, title in ORDERS.items() if found[0].params is not None or key in ("position", "events")
    }
    options = "".join(f'<option value="{key}">{page.text(title)}</option>' for key, title in orders.items())
    menus = "".join(_menu(name, sorted({getattr(sample, name) for sample in found})) for name in ("label", "split"))
    doubts = '<label><input type="checkbox" name="doubt"> doubtful only</label>'
    return (
        f'<div class="controls"><label>by <select name="order">{options}</select></label>'
        f'<label><input type="checkbox" name="down"> falling</label>{menus}'
        f'<input type="search" name="words" placeholder="name, shape, motion, texture" aria-label="search">'
        f"{doubts if found[0].params is not None else ''}<output></output></div>"
    )


def _menu(name: str, values: Sequence[str]) -> str:
    if len(values) < 2:
        return ""
    options = "".join(f'<option value="{page.text(value)}">{page.text(value)}</option>' for value in values)
    return f'<label>{name} <select name="{name}"><option value="">all</option>{options}</select></label>'
