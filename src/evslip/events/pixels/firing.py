"""Events of the marked pixels of a tile between two frames, in double precision.

Pixels are worked on side by side, in loops that become vector code. A round takes each to its next event, or noise
candidate, or to the end of its piece of the interval; those that have not come to the end then are in the next round.
"""

import math
from typing import NamedTuple

import numpy as np

from evslip.events.pixels import crossing, screen
from evslip.events.pixels.active_pixels import Scratch
from evslip.events.pixels.crossing import CLOSE, MOST_STEPS, Septic
from evslip.events.pixels.lowpass import advance_far
from evslip.events.pixels.pixel import (
    CANDIDATE_US,
    CANDIDATES,
    HOT_SHARE,
    LEAK_SLOPE,
    MEAN_LEAK,
    OFF,
    ON,
    ON_SHARE,
    RATE,
    REFERENCE,
    RESET_US,
    RESETS,
    Parameters,
    cause_of,
    next_candidate,
    next_leak,
    pieces,
    septic,
    word_of,
)
from evslip.events.pixels.screen import TILE
from evslip.events.pixels.state import HIGH, LOW, Pixels, Response, bounds
from evslip.events.sensor.exponential import exp, ln
from evslip.events.sensor.frame_buffer import Frames
from evslip.events.sensor.random_numbers import CANDIDATE, uniforms
from evslip.events.stream import HOT, SHOT
from evslip.utils.jit import compiled

_STRIDE = TILE + 8
"""Not a power of two, or all rows would fall into the same lines of the cache."""
_ROWS = range(0, 49 * _STRIDE, _STRIDE)
_PIXEL, _PLACE_IN_TILE, _LEFT, _LAST_CURRENT, _LAST_LAG = _ROWS[:5]
_LOG, _CHANGE, _CURRENT_0, _CURRENT_1, _LAG_0, _LAG_1, _NOISE, _NOISE_RISE, _START_US, _END_US, _AT = _ROWS[5:16]
_REFERENCE, _RESET_US, _LEAK, _CANDIDATE_US, _ON, _OFF, _MEAN, _RESETS = _ROWS[16:24]
_C0, _C1, _C2, _C3, _C4, _C5, _C6, _C7, _D0, _D1, _FROM, _TO, _PLACE, _SIGN, _CAUSE, _STATUS = _ROWS[24:40]
_TIME_US, _NEXT_LEAK, _DRAWN, _NUMBER, _RATE, _HOT, _SHARE, _CURRENT, _WAIT = _ROWS[40:]
ITEMS = len(_ROWS) * _STRIDE
"""Numbers of the marked pixels. Their own: number, place among the active ones; pieces of the interval that are left;
photocurrent and lag at the interval's end. Of their piece: L at its start and its change, photocurrent and lag at both
ends, photoreceptor noise, times; place up to which it is done. Their state (see `pixel`); lp as a polynomial, of which
`_D0` and `_D1` are the first coefficients of its distance to a threshold; stretch in which this is reached, place and
sign; cause of the event, how the round ended, time of the event, and the
leak after one. Of those that have come to a noise candidate, side by side: pixel,
number of the candidate, its process; photocurrent; time from the candidate to the next one."""
_KEPT = _C0 // _STRIDE
"""Rows that last from one round to the next."""
_FINISHED, _AGAIN, _NOISY = 0.0, 1.0, 2.0
_SAFE = 1e-6
"""Distance from a threshold, in ln units, within which a pixel that has fired is computed once more."""


class Span(NamedTuple):
    """Interval between two frames, or a part of it."""

    frame: int
    """Index of the frame at its end."""
    start_us: float
    end_us: float


@compiled(error_model="numpy", inline="always", _nrt=False)
def _stays(log_0: float, log_1: float, filtered_0: float, filtered_1: float, high: float, low: float) -> bool:
    """Whether lp certainly stays within (low, high); see `screen.marked`."""
    top, bottom = max(filtered_0, filtered_1), min(filtered_0, filtered_1)
    if (log_0 - filtered_0) * (log_1 - filtered_1) < 0.0:
        top, bottom = max(top, log_0, log_1), min(bottom, log_0, log_1)
    return top < high and bottom > low


@compiled(error_model="numpy", inline="always")
def whole_vectors(count: int) -> int:
    """Number of items to compute: what lies beyond the last one is never read, and would be computed one by one."""
    return (count + 15) & ~15


@compiled(error_model="numpy", _nrt=False)
def _gather(
    width: int, frames: Frames, span: Span, response: Response, pixels: Pixels, scratch: Scratch, current_0: np.ndarray
) -> int:
    """Numbers of the marked ones among `width` active pixels; current_0: photocurrents before the first frame."""
    image, before = frames.images[span.frame], frames.images[max(span.frame - 1, 0)]
    table, factor, offset = response.table, response.factor, response.offset
    state, items, values, marks, noise = pixels.state, scratch.items, scratch.values, scratch.marks, scratch.noise
    mark_words = marks.view(np.uint64)
    count = 0
    marks[width : width + 8] = 0
    for word in range((width + 7) >> 3):
        if mark_words[word] != 0:
            for k in range(8):
                items[_PLACE_IN_TILE + count] = (word << 3) + k
                count += np.int64(marks[(word << 3) + k] != 0)
    for j in range(count):
        k = int(items[_PLACE_IN_TILE + j])
        pixel = scratch.numbers[k]
        items[_PIXEL + j] = pixel
        if factor == 0.0:
            items[_CURRENT_1 + j], items[_CURRENT_0 + j] = table[np.uint8(image[pixel])], table[np.uint8(before[pixel])]
        else:
            items[_CURRENT_1 + j], items[_CURRENT_0 + j] = (
                image[pixel] * factor + offset,
                before[pixel] * factor + offset,
            )
        if span.frame == 0:
            items[_CURRENT_0 + j] = current_0[pixel]
        items[_LAG_0 + j], items[_LAG_1 + j] = values[screen.LAG_0 + k], values[screen.LAG + k]
        items[_NOISE + j], items[_NOISE_RISE + j] = noise[0, k], noise[1, k] - noise[0, k]
        items[_REFERENCE + j], items[_RESET_US + j] = state[pixel, REFERENCE], state[pixel, RESET_US]
        items[_LEAK + j], items[_CANDIDATE_US + j] = state[pixel, LEAK_SLOPE], state[pixel, CANDIDATE_US]
        items[_ON + j], items[_OFF + j] = state[pixel, ON], state[pixel, OFF]
        items[_MEAN + j], items[_RESETS + j] = state[pixel, MEAN_LEAK], state[pixel, RESETS]
        items[_START_US + j], items[_END_US + j], items[_AT + j] = span.start_us, span.end_us, 0.0
        items[_LEFT + j] = 1.0
    return int(count)


@compiled(error_model="numpy", _nrt=False)
def _find_logarithms(items: np.ndarray, count: int) -> None:
    for j in range(count):
        log = ln(items[_CURRENT_0 + j])
        items[_LOG + j], items[_CHANGE + j] = log, ln(items[_CURRENT_1 + j]) - log


@compiled(error_model="numpy", _nrt=False)
def _keep(items: np.ndarray, j: int, at: int) -> None:
    """Move an item to a place further ahead."""
    if j != at:
        for row in range(_KEPT):
            items[row * _STRIDE + at] = items[row * _STRIDE + j]


@compiled(error_model="numpy", _nrt=False)
def collect(
    width: int,
    frames: Frames,
    span: Span,
    response: Response,
    epoch_us: float,
    pixels: Pixels,
    params: Parameters,
    scratch: Scratch,
) -> int:
    """Prepare the marked ones among `width` active pixels of a tile for their first round. Returns their number."""
    items, values, marks, times_us = scratch.items, scratch.values, scratch.marks, frames.times_us
    count = _gather(width, frames, span, response, pixels, scratch, pixels.current)
    _find_logarithms(items, whole_vectors(count))
    frame_us, length_us = times_us[span.frame + 1] - times_us[span.frame], span.end_us - span.start_us
    since_us = span.end_us - epoch_us
    base, gain = params.base * length_us, params.gain * length_us
    kept = 0
    for j in range(count):
        k = int(items[_PLACE_IN_TILE + j])
        if (
            marks[k] == 1
            and math.isnan(items[_REFERENCE + j])
            and min(items[_RESET_US + j], items[_CANDIDATE_US + j]) > span.end_us
        ):
            continue
        log, change, current_0, current_1 = (
            items[_LOG + j],
            items[_CHANGE + j],
            items[_CURRENT_0 + j],
            items[_CURRENT_1 + j],
        )
        if length_us < frame_us:
            log += change * (span.start_us - times_us[span.frame]) / frame_us
            change *= length_us / frame_us
            current_0, current_1 = math.exp(log), math.exp(log + change)
            items[_LOG + j], items[_CHANGE + j] = log, change
            items[_CURRENT_0 + j], items[_CURRENT_1 + j] = current_0, current_1
        if params.lowpass:
            lag_0, lag_1 = items[_LAG_0 + j], items[_LAG_1 + j]
            if marks[k] & 2:
                filtered = advance_far(log, log + change, current_0, current_1, log + lag_0, base, gain)
                lag_1 = filtered - (log + change)
                lag = np.float32(lag_1)
                values[screen.LAG + k], values[screen.RESIDUE + k] = lag, lag_1 - lag
                values[screen.OFFSET + k], items[_LAG_1 + j] = values[screen.MIDDLE + k] - (log + change), lag_1
                if params.photoreceptor_noise == 0.0 and values[screen.DUE + k] > since_us:
                    high = values[screen.HIGH + k] - values[screen.SLOPE + k] * since_us
                    if _stays(log, log + change, log + lag_0, filtered, high, values[screen.LOW + k]):
                        continue
            steepest = base + gain * max(current_0, current_1)
            number = pieces(change, steepest, lag_0, lag_1, change + lag_1 - lag_0, length_us)
            if number > 1:
                items[_LEFT + j], items[_LAST_CURRENT + j], items[_LAST_LAG + j] = number, current_1, lag_1
                items[_CHANGE + j], items[_NOISE_RISE + j] = change / number, items[_NOISE_RISE + j] / number
                _begin_piece(items, j, span.end_us, params)
        if math.isnan(items[_REFERENCE + j]):
            _pass_held_candidates(items, j, params, pixels.noise_process)
        _keep(items, j, kept)
        kept += 1
    return kept


@compiled(error_model="numpy", _nrt=False)
def _begin_piece(items: np.ndarray, j: int, end_us: float, params: Parameters) -> None:
    """Find the end of an item's piece, of which the start is set; end_us: of the interval."""
    start_us, left = items[_START_US + j], items[_LEFT + j]
    items[_AT + j] = 0.0
    if left == 1.0:
        items[_END_US + j] = end_us
        items[_CURRENT_1 + j], items[_LAG_1 + j] = items[_LAST_CURRENT + j], items[_LAST_LAG + j]
        return
    span_us = (end_us - start_us) / left
    log_0, log_1 = items[_LOG + j], items[_LOG + j] + items[_CHANGE + j]
    current_0, current_1 = items[_CURRENT_0 + j], items[_CURRENT_0 + j] * math.exp(items[_CHANGE + j])
    filtered, base, gain = log_0 + items[_LAG_0 + j], params.base * span_us, params.gain * span_us
    filtered = advance_far(log_0, log_1, current_0, current_1, filtered, base, gain)
    items[_END_US + j], items[_CURRENT_1 + j], items[_LAG_1 + j] = start_us + span_us, current_1, filtered - log_1


@compiled(error_model="numpy", _nrt=False)
def _pass_held_candidates(items: np.ndarray, j: int, params: Parameters, noise_process: np.ndarray) -> None:
    """Pass over the noise candidates that come while a pixel is held in reset."""
    pixel = int(items[_PIXEL + j])
    while items[_CANDIDATE_US + j] < items[_RESET_US + j] and items[_CANDIDATE_US + j] <= items[_END_US + j]:
        _next_candidate(items, j, pixel, params, noise_process)


@compiled(error_model="numpy", _nrt=False)
def _next_candidate(items: np.ndarray, j: int, pixel: int, params: Parameters, noise_process: np.ndarray) -> None:
    number = noise_process[pixel, CANDIDATES] + 1.0
    noise_process[pixel, CANDIDATES] = number
    rate, candidate_us = noise_process[pixel, RATE], items[_CANDIDATE_US + j]
    items[_CANDIDATE_US + j] = next_candidate(params, rate, pixel, int(number), candidate_us)


@compiled(error_model="numpy", forceinline=True, _nrt=False)
def _polynomial(items: np.ndarray, j: int) -> Septic:
    return (
        items[_C0 + j],
        items[_C1 + j],
        items[_C2 + j],
        items[_C3 + j],
        items[_C4 + j],
        items[_C5 + j],
        items[_C6 + j],
        items[_C7 + j],
    )


@compiled(error_model="numpy", forceinline=True, _nrt=False)
def _distance(items: np.ndarray, j: int) -> Septic:
    _, _, c2, c3, c4, c5, c6, c7 = _polynomial(items, j)
    return items[_D0 + j], items[_D1 + j], c2, c3, c4, c5, c6, c7


@compiled(error_model="numpy", _nrt=False)
def _describe(items: np.ndarray, count: int, base: float, gain: float) -> None:
    """lp of each item on its piece, as a polynomial."""
    for j in range(count):
        span_us = items[_END_US + j] - items[_START_US + j]
        c = septic(
            items[_LOG + j],
            items[_CHANGE + j],
            items[_CURRENT_0 + j],
            items[_CURRENT_1 + j],
            items[_LAG_0 + j],
            items[_LAG_1 + j],
            base * span_us,
            gain * span_us,
        )
        items[_C0 + j], items[_C1 + j] = c[0] + items[_NOISE + j], c[1] + items[_NOISE_RISE + j]
        items[_C2 + j], items[_C3 + j], items[_C4 + j] = c[2], c[3], c[4]
        items[_C5 + j], items[_C6 + j], items[_C7 + j] = c[5], c[6], c[7]


@compiled(error_model="numpy", _nrt=False)
def _describe_straight(items: np.ndarray, count: int) -> None:
    for j in range(count):
        items[_C0 + j], items[_C1 + j] = items[_LOG + j], items[_CHANGE + j]
        items[_C2 + j] = items[_C3 + j] = items[_C4 + j] = items[_C5 + j] = items[_C6 + j] = items[_C7 + j] = 0.0


@compiled(error_model="numpy", _nrt=False)
def _bracket(items: np.ndarray, count: int) -> None:
    """Where each item first reaches a threshold in what is left of its piece, before its next noise candidate."""
    for j in range(count):
        c = _polynomial(items, j)
        start_us, end_us, at = items[_START_US + j], items[_END_US + j], items[_AT + j]
        reference, reset_us, leak = items[_REFERENCE + j], items[_RESET_US + j], items[_LEAK + j]
        candidate_us, on, off = items[_CANDIDATE_US + j], items[_ON + j], items[_OFF + j]
        span_us = end_us - start_us
        released = math.isnan(reference) & (reset_us <= end_us)
        at = min(max(at, (reset_us - start_us) / span_us), 1.0) if released else at
        reference = crossing.value(c, at) if released else reference
        until = min(max((candidate_us - start_us) / span_us, at), 1.0) if candidate_us <= end_us else 1.0
        d0, d1 = c[0] - reference + leak * (start_us - reset_us), c[1] + leak * span_us
        d = (d0, d1, c[2], c[3], c[4], c[5], c[6], c[7])
        begin, end, place, sign = crossing.bracket(d, at, until, on, off)
        items[_D0 + j], items[_D1 + j] = d0 - (on if sign > 0.0 else (-off if sign < 0.0 else 0.0)), d1
        items[_FROM + j], items[_TO + j], items[_PLACE + j], items[_SIGN + j] = begin, end, place, sign
        items[_REFERENCE + j] = reference


@compiled(error_model="numpy", _nrt=False)
def _refine(items: np.ndarray, count: int) -> bool:
    """A step of the search for each item that has not found its place. Returns whether there are more of these."""
    searching = False
    for j in range(count):
        begin, end, before, sign = items[_FROM + j], items[_TO + j], items[_PLACE + j], items[_SIGN + j]
        d = _distance(items, j)
        begin, end, place = crossing.refine(d, begin, end, before, sign)
        items[_FROM + j], items[_TO + j], items[_PLACE + j] = begin, end, place
        close = abs(place - before) < CLOSE
        # An empty stretch is where a search ends, whatever else is searched for.
        items[_FROM + j] = place if close else begin
        items[_TO + j] = place if close else end
        searching |= abs(place - before) >= CLOSE
    return searching


@compiled(error_model="numpy", _nrt=False)
def _conclude(items: np.ndarray, count: int, params: Parameters) -> None:
    """State of each item after the round, its event's cause, and what comes next."""
    refractory_us = params.refractory_us
    for j in range(count):
        c = _polynomial(items, j)
        start_us, end_us, place, sign = items[_START_US + j], items[_END_US + j], items[_PLACE + j], items[_SIGN + j]
        reference, reset_us, leak = items[_REFERENCE + j], items[_RESET_US + j], items[_LEAK + j]
        on, off, resets = items[_ON + j], items[_OFF + j], items[_RESETS + j]
        noise_rise, noisy = items[_NOISE_RISE + j], items[_CANDIDATE_US + j] <= end_us
        span_us, fired = end_us - start_us, sign != 0.0
        time_us, drift = start_us + place * span_us, leak * span_us
        push = crossing.slope(c, place) - noise_rise
        items[_CAUSE + j] = cause_of(sign * push, sign * noise_rise, sign * drift)
        level = reference + (on if sign > 0.0 else -off) - leak * (time_us - reset_us)
        leak_1 = next_leak(params, items[_MEAN + j], int(items[_PIXEL + j]), int(resets) + 1)
        reset_1_us = time_us + refractory_us
        # Whether it cannot fire again: it moves one way only, and not far enough.
        release = min((reset_1_us - start_us) / span_us, 1.0)
        reference_1 = level if refractory_us == 0.0 else crossing.value(c, release)
        one_way = crossing.slope(c, release) * crossing.slope(c, 1.0) > 0.0
        at_end = crossing.value(c, 1.0) - reference_1
        stays = one_way & (at_end + leak_1 * span_us < on - _SAFE) & (at_end > _SAFE - off)
        held = (refractory_us > 0.0) & (reset_1_us > end_us)
        over = held | stays
        items[_STATUS + j] = _FINISHED if (not noisy) & (over | (not fired)) else (_AGAIN if fired else _NOISY)
        reference_1 = np.nan if held | ((refractory_us > 0.0) & (noisy | (not stays))) else reference_1
        items[_REFERENCE + j] = reference_1 if fired else reference
        items[_RESET_US + j] = reset_1_us if fired else reset_us
        items[_LEAK + j] = leak_1 if fired else leak
        items[_TIME_US + j], items[_NEXT_LEAK + j] = time_us, leak_1
        items[_RESETS + j] = resets + (1.0 if fired else 0.0)
        items[_AT + j] = place


@compiled(error_model="numpy", _nrt=False)
def advance(items: np.ndarray, number: int, params: Parameters, noise_process: np.ndarray) -> None:
    """One round of all items."""
    count = whole_vectors(number)
    if params.lowpass:
        _describe(items, count, params.base, params.gain)
    else:
        _describe_straight(items, count)
    _bracket(items, count)
    for _ in range(MOST_STEPS):
        if not _refine(items, count):
            break
    _conclude(items, count, params)
    _draw_candidates(items, number, params, noise_process)


@compiled(error_model="numpy", _nrt=False)
def settle(
    number: int,
    frames: Frames,
    span: Span,
    epoch_us: float,
    pixels: Pixels,
    params: Parameters,
    scratch: Scratch,
    events: np.ndarray,
    count: int,
) -> tuple[int, int]:
    """Write the events of a round and the state of the items that have come to their end.

    events: (n, 2), time in microseconds and word (see `Sensor.tasks`), of which `count` are filled. Returns the number
    of items left, which are moved together, and of events.
    """
    items, noise_process, last_us = scratch.items, pixels.noise_process, frames.times_us[-1]
    kept = 0
    for j in range(number):
        pixel, status = int(items[_PIXEL + j]), items[_STATUS + j]
        sign, cause = items[_SIGN + j], int(items[_CAUSE + j])
        time_us, end_us = items[_TIME_US + j], items[_END_US + j]
        if sign != 0.0:
            events[count, 0] = np.int64(math.floor(time_us + 0.5))
            events[count, 1] = _word(pixel, time_us, sign, cause, frames, span.frame)
            count += 1
            if math.isnan(items[_REFERENCE + j]):
                _pass_held_candidates(items, j, params, noise_process)
        held_on = (
            math.isnan(items[_REFERENCE + j]) and min(items[_RESET_US + j], items[_CANDIDATE_US + j]) > span.end_us
        )
        if status == _FINISHED and (items[_LEFT + j] == 1.0 or held_on):
            _put_back(items, j, epoch_us, last_us, pixels, params, scratch)
            continue
        _keep(items, j, kept)
        if status == _FINISHED:
            items[_LEFT + kept] -= 1.0
            items[_START_US + kept] = end_us
            items[_LOG + kept] += items[_CHANGE + kept]
            items[_NOISE + kept] += items[_NOISE_RISE + kept]
            items[_CURRENT_0 + kept], items[_LAG_0 + kept] = items[_CURRENT_1 + kept], items[_LAG_1 + kept]
            _begin_piece(items, kept, span.end_us, params)
            if math.isnan(items[_REFERENCE + kept]):
                _pass_held_candidates(items, kept, params, noise_process)
        kept += 1
    return kept, count


@compiled(error_model="numpy", forceinline=True, _nrt=False)
def _word(pixel: int, time_us: float, sign: float, cause: int, frames: Frames, frame: int) -> int:
    body = 255
    if len(frames.bodies) > 0:
        middle_us = 0.5 * (frames.times_us[frame] + frames.times_us[frame + 1])
        body = int(frames.bodies[frame if time_us < middle_us else frame + 1, pixel])
    row = pixel // frames.columns
    address = ((pixel - row * frames.columns) << 16) | (row << 32) | (frame << 48)
    return word_of(address, int(sign), cause, body)


@compiled(error_model="numpy", _nrt=False)
def _draw_candidates(items: np.ndarray, number: int, params: Parameters, noise_process: np.ndarray) -> None:
    """Let the noise candidates to which items have come fire, or not, and find the next ones."""
    count = 0
    for j in range(number):
        if items[_STATUS + j] == _NOISY:
            pixel = int(items[_PIXEL + j])
            items[_DRAWN + count], items[_NUMBER + count] = pixel, noise_process[pixel, CANDIDATES]
            items[_RATE + count], items[_HOT + count] = noise_process[pixel, RATE], noise_process[pixel, HOT_SHARE]
            items[_SHARE + count] = noise_process[pixel, ON_SHARE]
            items[_CURRENT + count] = items[_LOG + j] + items[_CHANGE + j] * items[_PLACE + j]
            noise_process[pixel, CANDIDATES] += 1.0
            count += 1
    for k in range(whole_vectors(count)):
        pixel, candidate, current = int(items[_DRAWN + k]), int(items[_NUMBER + k]), exp(items[_CURRENT + k])
        _, pick, chance, side = uniforms(params.seed, pixel, CANDIDATE, candidate)
        wait, _, _, _ = uniforms(params.seed, pixel, CANDIDATE, candidate + 1)
        hot = pick < items[_HOT + k]
        fired = hot | (chance < max(params.shot_dark - params.shot_slope * current, params.shot_least))
        sign = 1.0 if hot | (side < items[_SHARE + k]) else -1.0
        items[_WAIT + k] = -ln(wait) / items[_RATE + k]
        items[_HOT + k], items[_SHARE + k] = HOT if hot else SHOT, sign if fired else 0.0
    count = 0
    for j in range(number):
        if items[_STATUS + j] == _NOISY:
            _take_candidate(items, j, items[_SHARE + count], items[_WAIT + count], params.refractory_us)
            items[_CAUSE + j] = items[_HOT + count]
            count += 1


@compiled(error_model="numpy", forceinline=True, _nrt=False)
def _take_candidate(items: np.ndarray, j: int, sign: float, wait_us: float, refractory_us: float) -> None:
    """Set an item's event at its noise candidate, and when the next one comes; sign: of the event, 0: none."""
    c, place, end_us, time_us = _polynomial(items, j), items[_PLACE + j], items[_END_US + j], items[_CANDIDATE_US + j]
    items[_TIME_US + j], items[_SIGN + j], items[_CANDIDATE_US + j] = time_us, sign, time_us + wait_us
    if sign != 0.0:
        items[_RESET_US + j] = time_us + refractory_us
        items[_REFERENCE + j] = crossing.value(c, place) if refractory_us == 0.0 else np.nan
        items[_RESETS + j] += 1.0
        items[_LEAK + j] = items[_NEXT_LEAK + j]
    distance, drift = crossing.value(c, 1.0) - items[_REFERENCE + j], items[_LEAK + j] * (end_us - items[_RESET_US + j])
    stays = distance + drift < items[_ON + j] - _SAFE and distance > _SAFE - items[_OFF + j]
    one_way = crossing.slope(c, place) * crossing.slope(c, 1.0) > 0.0
    items[_STATUS + j] = _FINISHED if stays and one_way and time_us + wait_us > end_us else _AGAIN


@compiled(error_model="numpy", forceinline=True, _nrt=False)
def _put_back(
    items: np.ndarray, j: int, epoch_us: float, last_us: float, pixels: Pixels, params: Parameters, scratch: Scratch
) -> None:
    """Write an item's state, and the bounds that follow from it; last_us: time of the last frame."""
    state, values = pixels.state, scratch.values
    pixel, k = int(items[_PIXEL + j]), int(items[_PLACE_IN_TILE + j])
    state[pixel, REFERENCE], state[pixel, RESET_US] = items[_REFERENCE + j], items[_RESET_US + j]
    state[pixel, LEAK_SLOPE], state[pixel, CANDIDATE_US] = items[_LEAK + j], items[_CANDIDATE_US + j]
    state[pixel, RESETS] = items[_RESETS + j]
    high, low, slope, due_us = bounds(pixel, state, epoch_us)
    values[screen.SLOPE + k], values[screen.DUE + k] = slope, due_us
    if due_us <= last_us - epoch_us:
        scratch.due[0] = 1
    if params.photoreceptor_noise == 0.0:
        values[screen.HIGH + k], values[screen.LOW + k] = high, low
        single_us = np.float32(last_us - epoch_us)
        middle, half = screen.middle_and_half(np.float32(high), np.float32(low), np.float32(slope), single_us)
        values[screen.MIDDLE + k], values[screen.HALF + k] = middle, half
        values[screen.OFFSET + k] = middle - (items[_LOG + j] + items[_CHANGE + j])
    else:
        # The scratch values are narrowed by the noise of this very interval.
        pixels.screen[HIGH, pixel], pixels.screen[LOW, pixel] = high, low
