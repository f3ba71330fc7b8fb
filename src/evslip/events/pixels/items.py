"""Marked pixels of a tile between two frames: their numbers side by side, in double precision, see `rounds`."""

import math
from typing import NamedTuple

import numpy as np

from evslip.events.pixels import pixel as fields
from evslip.events.pixels import screen
from evslip.events.pixels.active_pixels import Scratch
from evslip.events.pixels.lowpass import advance_far, advance_steady, is_steady
from evslip.events.pixels.pixel import Parameters, next_candidate, pieces, septic_error, settling_share, tolerance
from evslip.events.pixels.screen import TILE
from evslip.events.pixels.state import Pixels, Response
from evslip.events.sensor.exponential import exp, ln
from evslip.events.sensor.frame_buffer import Frames
from evslip.utils.jit import compiled

_STRIDE = TILE + 8
"""Not a power of two, or all rows would fall into the same lines of the cache."""
_ROWS = range(0, 49 * _STRIDE, _STRIDE)
PIXEL, PLACE_IN_TILE, LEFT, LAST_CURRENT, LAST_LAG = _ROWS[:5]
LOG, CHANGE, CURRENT_0, CURRENT_1, LAG_0, LAG_1, NOISE, NOISE_RISE, START_US, END_US, AT = _ROWS[5:16]
REFERENCE, RESET_US, LEAK, CANDIDATE_US, ON, OFF, MEAN, RESETS = _ROWS[16:24]
C0, C1, C2, C3, C4, C5, C6, C7, D0, D1, FROM, TO, PLACE, SIGN, CAUSE, STATUS = _ROWS[24:40]
TIME_US, NEXT_LEAK, DRAWN, NUMBER, RATE, HOT, SHARE, CURRENT, WAIT = _ROWS[40:]
ITEMS = len(_ROWS) * _STRIDE
"""Numbers of the marked pixels. Their own: number, place among the active ones; pieces of the interval that are left;
photocurrent and lag at the interval's end. Of their piece: L at its start and its change, photocurrent and lag at both
ends, photoreceptor noise, times; place up to which it is done. Their state (see `pixel`); lp as a polynomial, of which
`D0` and `D1` are the first coefficients of its distance to a threshold; stretch in which this is reached, place and
sign; cause of the event, how the round ended, time of the event, leak after one. Of those that have come to a noise
candidate, side by side: pixel, number of the candidate, its process, L, time from the candidate to the next one."""
_KEPT = C0 // _STRIDE
"""Rows that last from one round to the next."""


class Span(NamedTuple):
    """Interval between two frames, or a part of it."""

    frame: int
    """Index of the frame at its end."""
    start_us: float
    end_us: float


@compiled(error_model="numpy", forceinline=True)
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
    number = _find_marked(marks, width, scratch.marked)
    j = 0
    for n in range(number):
        k = scratch.marked[n]
        pixel = scratch.numbers[k]
        items[PIXEL + j], items[PLACE_IN_TILE + j] = pixel, k
        if factor == 0.0:
            items[CURRENT_1 + j], items[CURRENT_0 + j] = table[np.uint8(image[pixel])], table[np.uint8(before[pixel])]
        else:
            items[CURRENT_1 + j] = image[pixel] * factor + offset
            items[CURRENT_0 + j] = before[pixel] * factor + offset
        if span.frame == 0:
            items[CURRENT_0 + j] = current_0[pixel]
        items[LAG_0 + j], items[LAG_1 + j] = values[screen.LAG_0 + k], values[screen.LAG + k]
        items[NOISE + j], items[NOISE_RISE + j] = noise[0, k], noise[1, k] - noise[0, k]
        reference, reset_us = state[pixel, fields.REFERENCE], state[pixel, fields.RESET_US]
        candidate_us = state[pixel, fields.CANDIDATE_US]
        items[REFERENCE + j], items[RESET_US + j] = reference, reset_us
        items[LEAK + j], items[CANDIDATE_US + j] = state[pixel, fields.LEAK_SLOPE], candidate_us
        items[ON + j], items[OFF + j] = state[pixel, fields.ON], state[pixel, fields.OFF]
        items[MEAN + j], items[RESETS + j] = state[pixel, fields.MEAN_LEAK], state[pixel, fields.RESETS]
        # One that is held in reset all the time is left out, without a branch.
        held = math.isnan(reference) & (reset_us > span.end_us) & (candidate_us > span.end_us) & (marks[k] == 1)
        j += 1 - np.int64(held)
    return int(j)


@compiled(error_model="numpy", _nrt=False)
def _find_marked(marks: np.ndarray, width: int, marked: np.ndarray) -> int:
    """Places of all marks but 0 among the first; marks has room for 8 more. Returns their number."""
    words = marks.view(np.uint64)
    marks[width : width + 8] = 0
    count = 0
    for word in range((width + 7) >> 3):
        if words[word] != 0:
            for k in range(8):
                marked[count] = (word << 3) + k
                count += np.int64(marks[(word << 3) + k] != 0)
    return int(count)


@compiled(error_model="numpy", _nrt=False)
def _begin(items: np.ndarray, count: int, start_us: float, end_us: float, base: float, gain: float) -> None:
    """Set each item to the start of the interval, `LEFT` to 1, or to 0 where it may need more than one piece; base and
    gain: already multiplied by the interval's length, 0 without low-pass."""
    length_us = end_us - start_us
    for j in range(count):
        log, current_0, current_1 = ln(items[CURRENT_0 + j]), items[CURRENT_0 + j], items[CURRENT_1 + j]
        change, lag_0, lag_1 = ln(current_1) - log, items[LAG_0 + j], items[LAG_1 + j]
        items[LOG + j], items[CHANGE + j] = log, change
        items[START_US + j], items[END_US + j], items[AT + j] = start_us, end_us, 0.0
        error = septic_error(change, base + gain * max(current_0, current_1), lag_0, lag_1)
        items[LEFT + j] = 1.0 if error <= tolerance(change + lag_1 - lag_0, length_us) else 0.0


@compiled(error_model="numpy", _nrt=False)
def keep(items: np.ndarray, j: int, at: int) -> None:
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
    frame_us, length_us = times_us[span.frame + 1] - times_us[span.frame], span.end_us - span.start_us
    base, gain = (params.base * length_us, params.gain * length_us) if params.lowpass else (0.0, 0.0)
    _begin(items, whole_vectors(count), span.start_us, span.end_us, base, gain)
    kept = 0
    for j in range(count):
        k = int(items[PLACE_IN_TILE + j])
        if length_us < frame_us:
            _cut(items, j, (span.start_us - times_us[span.frame]) / frame_us, length_us / frame_us)
        if marks[k] & 2 and params.lowpass:
            _advance_wide(items, j, base, gain, values)
            due = params.photoreceptor_noise > 0.0 or values[screen.DUE + k] <= span.end_us - epoch_us
            if not due and _stays(items, j, values, span.end_us - epoch_us):
                continue
        if items[LEFT + j] == 0.0 or marks[k] & 2 or length_us < frame_us:
            _divide(items, j, span, params)
        if math.isnan(items[REFERENCE + j]):
            pass_held_candidates(items, j, params, pixels.noise_process)
        keep(items, j, kept)
        kept += 1
    return kept


@compiled(error_model="numpy", _nrt=False)
def _cut(items: np.ndarray, j: int, from_share: float, share: float) -> None:
    """Reduce an item from the whole interval between two frames to a part of it."""
    log, change = items[LOG + j] + items[CHANGE + j] * from_share, items[CHANGE + j] * share
    items[LOG + j], items[CHANGE + j] = log, change
    items[CURRENT_0 + j], items[CURRENT_1 + j] = exp(log), exp(log + change)


@compiled(error_model="numpy", _nrt=False)
def _advance_wide(items: np.ndarray, j: int, base: float, gain: float, values: np.ndarray) -> None:
    """Low-pass of an item for whose interval single precision does not suffice."""
    k, log_0, log_1 = int(items[PLACE_IN_TILE + j]), items[LOG + j], items[LOG + j] + items[CHANGE + j]
    filtered = log_0 + items[LAG_0 + j]
    filtered = advance_far(log_0, log_1, items[CURRENT_0 + j], items[CURRENT_1 + j], filtered, base, gain)
    lag = np.float32(filtered - log_1)
    items[LAG_1 + j] = filtered - log_1
    values[screen.LAG + k], values[screen.RESIDUE + k] = lag, filtered - log_1 - lag
    values[screen.OFFSET + k] = values[screen.MIDDLE + k] - log_1


@compiled(error_model="numpy", _nrt=False)
def _stays(items: np.ndarray, j: int, values: np.ndarray, since_us: float) -> bool:
    """Whether an item's lp certainly stays within its bounds; see `screen.marked`."""
    k, log_0, log_1 = int(items[PLACE_IN_TILE + j]), items[LOG + j], items[LOG + j] + items[CHANGE + j]
    lag_0, lag_1 = items[LAG_0 + j], items[LAG_1 + j]
    top, bottom = max(log_0 + lag_0, log_1 + lag_1), min(log_0 + lag_0, log_1 + lag_1)
    if lag_0 * lag_1 < 0.0:
        top, bottom = max(top, log_0, log_1), min(bottom, log_0, log_1)
    return top < values[screen.HIGH + k] - values[screen.SLOPE + k] * since_us and bottom > values[screen.LOW + k]


@compiled(error_model="numpy", _nrt=False)
def _divide(items: np.ndarray, j: int, span: Span, params: Parameters) -> None:
    """Divide an item's interval into as many pieces as it needs, and begin with the first."""
    length_us = span.end_us - span.start_us
    current_0, current_1, lag_1 = items[CURRENT_0 + j], items[CURRENT_1 + j], items[LAG_1 + j]
    base, gain, change, lag_0 = params.base * length_us, params.gain * length_us, items[CHANGE + j], items[LAG_0 + j]
    steepest = base + gain * max(current_0, current_1)
    number = pieces(change, steepest, lag_0, lag_1, length_us) if params.lowpass else 1
    items[LAST_CURRENT + j], items[LAST_LAG + j] = current_1, lag_1
    if number > fields.EQUAL_PIECES and is_steady(change, current_0, current_1, base, gain):
        items[LEFT + j] = np.inf
        # The last piece may be of many time constants, over which `septic` makes much of the lag's single precision.
        items[LAST_LAG + j] = advance_steady(change, current_0, current_1, lag_0, base, gain)
    else:
        items[LEFT + j] = number
        items[CHANGE + j], items[NOISE_RISE + j] = change / number, items[NOISE_RISE + j] / number
    begin_piece(items, j, span.end_us, params)


@compiled(error_model="numpy", _nrt=False)
def begin_piece(items: np.ndarray, j: int, end_us: float, params: Parameters) -> None:
    """Find the end of an item's piece, of which the start is set; end_us: of the interval. Where the number of pieces
    left is infinite, changes of light and noise are those up to the end."""
    start_us, left = items[START_US + j], items[LEFT + j]
    items[AT + j] = 0.0
    if left == np.inf:
        rest_us, change, last = end_us - start_us, items[CHANGE + j], items[LAST_CURRENT + j]
        base, gain = params.base * rest_us, params.gain * rest_us
        lags = items[LAG_0 + j], items[LAST_LAG + j]
        share = settling_share(change, items[CURRENT_0 + j], last, *lags, base, gain, rest_us)
        left = 1.0 / share
        items[CHANGE + j], items[NOISE_RISE + j] = share * change, share * items[NOISE_RISE + j]
        items[LEFT + j] = 1.0 if share == 1.0 else np.inf
    if left == 1.0:
        items[END_US + j] = end_us
        items[CURRENT_1 + j], items[LAG_1 + j] = items[LAST_CURRENT + j], items[LAST_LAG + j]
        return
    span_us = (end_us - start_us) / left
    base, gain = params.base * span_us, params.gain * span_us
    log_0, change, current_0, lag_0 = items[LOG + j], items[CHANGE + j], items[CURRENT_0 + j], items[LAG_0 + j]
    log_1, current_1 = log_0 + change, current_0 * exp(change)
    if items[LEFT + j] == np.inf:
        # As a difference of logarithms the lag of a fast filter would be rounded by so much that it never settles.
        lag_1 = advance_steady(change, current_0, current_1, lag_0, base, gain)
    else:
        lag_1 = advance_far(log_0, log_1, current_0, current_1, log_0 + lag_0, base, gain) - log_1
    items[END_US + j], items[CURRENT_1 + j], items[LAG_1 + j] = start_us + span_us, current_1, lag_1


@compiled(error_model="numpy", _nrt=False)
def pass_held_candidates(items: np.ndarray, j: int, params: Parameters, noise_process: np.ndarray) -> None:
    """Pass over the noise candidates that come while a pixel is held in reset."""
    pixel = int(items[PIXEL + j])
    while items[CANDIDATE_US + j] < items[RESET_US + j] and items[CANDIDATE_US + j] <= items[END_US + j]:
        _next_candidate(items, j, pixel, params, noise_process)


@compiled(error_model="numpy", _nrt=False)
def _next_candidate(items: np.ndarray, j: int, pixel: int, params: Parameters, noise_process: np.ndarray) -> None:
    number = noise_process[pixel, fields.CANDIDATES] + 1.0
    noise_process[pixel, fields.CANDIDATES] = number
    rate, candidate_us = noise_process[pixel, fields.RATE], items[CANDIDATE_US + j]
    items[CANDIDATE_US + j] = next_candidate(params, rate, pixel, int(number), candidate_us)
