"""Quality in words: what was found, and what of it hurts a detector, with what to do."""

from collections.abc import Iterator

from evslip.events.quality.flicker import Flicker
from evslip.events.quality.quality import WINDOW_S, Quality

ONE_SIDED = 0.9
"""Share of one polarity from which on a detector misses the other."""
HOT_SHARE = 0.02
"""Share of a quiet window's events that come from hot pixels from which on a detector sees them, and"""
HOT_PER_WINDOW = 5.0
"""... so many of them."""
DEAD_SHARE = 1e-3
"""Dead pixels over those judged."""
FEW_BURSTS = 2
"""So many hurt nobody."""
UNKNOWN = 0.1
"""Standard error of a drift from which on nothing can be said."""
DRIFT_S = 10.0
"""Shorter recordings see motion change, not thresholds, which follow temperature and light."""
MAINS_HZ = (50.0, 60.0)
SYNCHRONY = 0.1
"""Share of the events in step with the lamp from which on a detector sees the lamp."""


def described(quality: Quality) -> dict[str, str]:
    """A line for each question, by its name."""
    if not quality.count:
        return {}
    lines = {
        "clock": f"times in steps of {quality.resolution_us:,} us",
        "saturation": _saturation(quality),
        "loss": _loss(quality),
        "bursts": _bursts(quality),
        "hot": _hot(quality),
        "dead": _dead(quality),
        "flicker": _flicker(quality),
        "drift": _drift(quality),
    }
    if quality.examined_s < 0.99 * quality.seconds:
        lines["note"] = f"saturation, loss, flashes and flicker: of the first {quality.examined_s:.0f} s"
    return lines


def harms(quality: Quality) -> list[str]:
    """Findings that hurt a detector, a line each: what happens, and what to do."""
    return list(_harms(quality))


def _saturation(quality: Quality) -> str:
    found, peak = quality.saturation, f"at most {quality.peak_hz / 1e3:,.0f} k events/s"
    if found is None:
        return f"none seen: {peak}, without a plateau"
    return f"{found.share:.1%} of the time at the limit of {found.limit_hz / 1e3:,.0f} k {found.of}/s; {peak}"


def _loss(quality: Quality) -> str:
    found = quality.losses
    unseen = "events lost one by one leave no trace"
    if not found.number:
        return f"no gap where events were to be expected; {unseen}"
    begin, length = found.longest[0]
    return (
        f"{found.number} gaps of {found.seconds:.3f} s in all, where {found.events:,.0f} events were to be expected; "
        f"the longest {length * 1e3:g} ms, {begin:.3f} s after the start; {unseen}"
    )


def _bursts(quality: Quality) -> str:
    parts = []
    for name, found in (("rows", quality.row_bursts), ("columns", quality.column_bursts)):
        if found.number:
            first = ", ".join(str(line) for line in list(found.lines)[:5]) + (", ..." if len(found.lines) > 5 else "")
            parts.append(f"{found.number} of {name} ({found.events:,} events; {name} {first})")
    if quality.flashes.number:
        parts.append(f"{quality.flashes.number} all over the sensor ({quality.flashes.events:,.0f} events)")
    return "; ".join(parts) or "none of rows, columns, or all over the sensor"


def _hot(quality: Quality) -> str:
    if quality.pixels is None:
        return "not judged: the sensor is too large"
    hot = quality.pixels.hot
    if not len(hot):
        return "no pixel"
    where = ", ".join(f"x {x} y {y}" for x, y in hot[:3].tolist()) + (", ..." if len(hot) > 3 else "")
    return f"{len(hot)} pixels with {quality.pixels.hot_events / quality.count:.1%} of the events: {where}"


def _dead(quality: Quality) -> str:
    if quality.pixels is None:
        return "not judged: the sensor is too large"
    dead, judged = quality.pixels.dead, quality.pixels.judged
    if not judged:
        return "not judged: too few events around any pixel"
    where = ", ".join(f"x {x} y {y}" for x, y in dead[:3].tolist()) + (", ..." if len(dead) > 3 else "")
    said = f"{len(dead)} pixels: {where}" if len(dead) else "no pixel"
    return f"{said}; of the {judged:,} pixels around which enough happened"


def _flicker(quality: Quality) -> str:
    found = quality.flicker
    if found is None:
        return "not judged: too short, or too few events"
    if found.cause == "none":
        return "none seen"
    at = f"{found.frequency_hz:.1f} Hz (± {found.resolution_hz:.1f})"
    sure = f"by chance with a probability of {max(found.false_alarm, 1e-12):.0e}" + " or less" * (
        found.false_alarm < 1e-12
    )
    parts = f"{found.blocks:.0f} of 16 parts of the picture take part, {found.in_phase:.0%} in step"
    what = {"mains": "lamp on the mains,", "light": "light or the camera's own frames,", "": "light or vibration,"}
    return f"{what[_source(found)]} {at}, {sure}; {parts}; {found.synchrony:.0%} of the events in step with it"


def _source(found: Flicker) -> str:
    """Source of the flicker: the mains, light of another period, or "" where it is not known."""
    if found.cause != "lamp":
        return ""
    off = min(abs(found.frequency_hz - mains * round(found.frequency_hz / mains)) for mains in MAINS_HZ)
    return "mains" if off <= found.resolution_hz + 0.002 * found.frequency_hz else "light"


def _drift(quality: Quality) -> str:
    found = quality.drift
    if found is None:
        return "not judged: too few events, or too short"
    if quality.seconds < DRIFT_S:
        verdict = f"in less than {DRIFT_S:g} s motion changes it, too"
    elif found.is_certain:
        verdict = f"drifts by {found.change:+.0%} ± {found.error:.0%}, beyond what goes along with the rate"
    elif found.error > UNKNOWN:
        verdict = "it scatters too much to tell a drift"
    else:
        verdict = f"no drift beyond ± {4 * found.error:.0%}"
    return (
        f"ON/OFF {found.ratio_begin:.2f} to {found.ratio_end:.2f}: {verdict}; rate {found.rate_begin_hz / 1e3:,.1f} to "
        f"{found.rate_end_hz / 1e3:,.1f} k/s, of motion, light or thresholds: events cannot tell"
    )


def _harms(quality: Quality) -> Iterator[str]:
    if not quality.count:
        return
    if abs(quality.on_share - 0.5) > ONE_SIDED - 0.5:
        most, other = ("ON", "OFF") if quality.on_share > 0.5 else ("OFF", "ON")
        share = max(quality.on_share, 1 - quality.on_share)
        yield (
            f"polarity: {share:.0%} of the events are {most}, and detectors need both; lower the {other} threshold, or "
            "look at what wrote the file"
        )
    limit = quality.saturation
    if limit is not None:
        key = "bus_rate_hz" if limit.of == "events" else "row_us"
        value = f"{limit.limit_hz:.3g}" if limit.of == "events" else f"{1e6 / limit.limit_hz:.3g}"
        yield (
            "saturation: events come late and are lost while much moves; raise the thresholds or crop the sensor, or "
            f"train with samples of readout.{key}={value}"
        )
    if quality.losses.number:
        yield (
            "loss: a gap looks like a stop, its end like a slip; mend the transport (buffer, cable, disk), and leave "
            f"windows with one out: {quality.losses.number} gaps"
        )
    lines = quality.row_bursts.number + quality.column_bursts.number
    if lines + quality.flashes.number > FEW_BURSTS:
        rates = [
            f"readout.{key}={number / max(quality.seconds, 1e-6):.2g}"
            for key, number in (
                ("row_bursts_hz", quality.row_bursts.number),
                ("column_bursts_hz", quality.column_bursts.number),
                ("pixel_bursts_hz", quality.flashes.number),
            )
            if number
        ]
        cure = f"mend supply and cable, or train with samples of {', '.join(rates)}"
        yield f"bursts: a burst may be taken for a slip; {cure}"
    if quality.pixels is not None and len(quality.pixels.hot):
        per_window = quality.pixels.hot_events / max(quality.seconds, WINDOW_S) * WINDOW_S
        share = per_window / max(quality.quiet_hz * WINDOW_S, per_window)
        if share > HOT_SHARE and per_window > HOT_PER_WINDOW:
            yield (
                f"hot pixels: {per_window:,.0f} events of theirs in each window of {WINDOW_S} s, {share:.0%} of those "
                "of a quiet one; leave them out (`evslip info FILE --hot HOT.csv`, `evslip convert FILE OUT --without "
                "HOT.csv`), or train with --noise-hz 5"
            )
    if quality.pixels is not None and len(quality.pixels.dead) > max(3, DEAD_SHARE * quality.pixels.judged):
        yield f"dead pixels: {len(quality.pixels.dead)} holes in the picture; look at readout and lens"
    found = quality.flicker
    if found is not None and found.cause == "lamp" and found.synchrony > SYNCHRONY:
        cure = "take a DC lamp" if _source(found) == "mains" else "take a DC lamp, or switch the camera's frames off"
        yield (
            f"flicker: {found.synchrony:.0%} of the events come in step at {found.frequency_hz:.0f} Hz; {cure}, or "
            f"train with samples of flicker.lamp_depth=0.2 and flicker.frequency_hz={found.frequency_hz:.0f}"
        )
    if quality.drift is not None and quality.drift.is_certain and quality.seconds >= DRIFT_S:
        yield (
            "drift: ON and OFF change their weights while recording; let the camera warm up, compare `evslip "
            "calibrate` of the begin and of the end, or train with --noise-hz 5"
        )
