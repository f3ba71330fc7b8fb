"""Events of the marked pixels of a tile between two frames, in double precision.

Pixels are worked on side by side, in loops that become vector code. A round takes each to its next event, or noise
candidate, or to the end of its piece of the interval; those that have not come to the end then are in the next round.
"""

import math

import numpy as np

from evslip.events.pixels import crossing, screen
from evslip.events.pixels import items as rows
from evslip.events.pixels import pixel as fields
from evslip.events.pixels.active_pixels import Scratch
from evslip.events.pixels.crossing import CLOSE, MOST_STEPS, Septic
from evslip.events.pixels.pixel import Parameters, cause_of, next_leak, septic, word_of
from evslip.events.pixels.state import HIGH, LOW, Pixels, bounds
from evslip.events.sensor.exponential import exp, ln
from evslip.events.sensor.frame_buffer import Frames
from evslip.events.sensor.random_numbers import CANDIDATE, uniforms
from evslip.events.stream import HOT, SHOT
from evslip.utils.jit import compiled

_FINISHED, _AGAIN, _NOISY = 0.0, 1.0, 2.0
_SAFE = 1e-6
"""Distance from a threshold, in ln units, within which a pixel that has fired is computed once more."""


@compiled(error_model="numpy", forceinline=True, _nrt=False)
def _polynomial(items: np.ndarray, j: int) -> Septic:
    return (
        items[rows.C0 + j],
        items[rows.C1 + j],
        items[rows.C2 + j],
        items[rows.C3 + j],
        items[rows.C4 + j],
        items[rows.C5 + j],
        items[rows.C6 + j],
        items[rows.C7 + j],
    )


@compiled(error_model="numpy", forceinline=True, _nrt=False)
def _distance(items: np.ndarray, j: int) -> Septic:
    _, _, c2, c3, c4, c5, c6, c7 = _polynomial(items, j)
    return items[rows.D0 + j], items[rows.D1 + j], c2, c3, c4, c5, c6, c7


@compiled(error_model="numpy", _nrt=False)
def _describe(items: np.ndarray, count: int, base: float, gain: float) -> None:
    """lp of each item on its piece, as a polynomial."""
    for j in range(count):
        span_us = items[rows.END_US + j] - items[rows.START_US + j]
        c = septic(
            items[rows.LOG + j],
            items[rows.CHANGE + j],
            items[rows.CURRENT_0 + j],
            items[rows.CURRENT_1 + j],
            items[rows.LAG_0 + j],
            items[rows.LAG_1 + j],
            base * span_us,
            gain * span_us,
        )
        items[rows.C0 + j], items[rows.C1 + j] = c[0] + items[rows.NOISE + j], c[1] + items[rows.NOISE_RISE + j]
        items[rows.C2 + j], items[rows.C3 + j], items[rows.C4 + j] = c[2], c[3], c[4]
        items[rows.C5 + j], items[rows.C6 + j], items[rows.C7 + j] = c[5], c[6], c[7]


@compiled(error_model="numpy", _nrt=False)
def _describe_straight(items: np.ndarray, count: int) -> None:
    for j in range(count):
        items[rows.C0 + j], items[rows.C1 + j] = items[rows.LOG + j], items[rows.CHANGE + j]
        items[rows.C2 + j], items[rows.C3 + j], items[rows.C4 + j] = 0.0, 0.0, 0.0
        items[rows.C5 + j], items[rows.C6 + j], items[rows.C7 + j] = 0.0, 0.0, 0.0


@compiled(error_model="numpy", _nrt=False)
def _bracket(items: np.ndarray, count: int) -> None:
    """Where each item first reaches a threshold in what is left of its piece, before its next noise candidate."""
    for j in range(count):
        c = _polynomial(items, j)
        start_us, end_us, at = items[rows.START_US + j], items[rows.END_US + j], items[rows.AT + j]
        reference, reset_us, leak = items[rows.REFERENCE + j], items[rows.RESET_US + j], items[rows.LEAK + j]
        candidate_us, on, off = items[rows.CANDIDATE_US + j], items[rows.ON + j], items[rows.OFF + j]
        span_us = end_us - start_us
        released = math.isnan(reference) & (reset_us <= end_us)
        at = min(max(at, (reset_us - start_us) / span_us), 1.0) if released else at
        reference = crossing.value(c, at) if released else reference
        until = min(max((candidate_us - start_us) / span_us, at), 1.0) if candidate_us <= end_us else 1.0
        d0, d1 = c[0] - reference + leak * (start_us - reset_us), c[1] + leak * span_us
        d = (d0, d1, c[2], c[3], c[4], c[5], c[6], c[7])
        begin, end, place, sign = crossing.bracket(d, at, until, on, off)
        items[rows.D0 + j], items[rows.D1 + j] = d0 - (on if sign > 0.0 else (-off if sign < 0.0 else 0.0)), d1
        items[rows.FROM + j], items[rows.TO + j], items[rows.PLACE + j], items[rows.SIGN + j] = begin, end, place, sign
        items[rows.REFERENCE + j] = reference


@compiled(error_model="numpy", _nrt=False)
def _refine(items: np.ndarray, count: int) -> bool:
    """A step of the search for each item that has not found its place. Returns whether there are more of these."""
    searching = False
    for j in range(count):
        begin, end, before, sign = items[rows.FROM + j], items[rows.TO + j], items[rows.PLACE + j], items[rows.SIGN + j]
        d = _distance(items, j)
        begin, end, place = crossing.refine(d, begin, end, before, sign)
        close = abs(place - before) < CLOSE
        # An empty stretch is where a search ends, whatever else is searched for.
        items[rows.FROM + j] = place if close else begin
        items[rows.TO + j], items[rows.PLACE + j] = place if close else end, place
        searching |= abs(place - before) >= CLOSE  # not `not close`: past the last item there may be no numbers
    return searching


@compiled(error_model="numpy", _nrt=False)
def _conclude(items: np.ndarray, count: int, params: Parameters) -> None:
    """State of each item after the round, its event's cause, and what comes next."""
    refractory_us = params.refractory_us
    for j in range(count):
        c = _polynomial(items, j)
        start_us, end_us = items[rows.START_US + j], items[rows.END_US + j]
        place, sign = items[rows.PLACE + j], items[rows.SIGN + j]
        reference, reset_us, leak = items[rows.REFERENCE + j], items[rows.RESET_US + j], items[rows.LEAK + j]
        on, off, resets = items[rows.ON + j], items[rows.OFF + j], items[rows.RESETS + j]
        noise_rise, noisy = items[rows.NOISE_RISE + j], items[rows.CANDIDATE_US + j] <= end_us
        span_us, fired = end_us - start_us, sign != 0.0
        time_us, drift = start_us + place * span_us, leak * span_us
        push = crossing.slope(c, place) - noise_rise
        items[rows.CAUSE + j] = cause_of(sign * push, sign * noise_rise, sign * drift)
        level = reference + (on if sign > 0.0 else -off) - leak * (time_us - reset_us)
        current = exp(items[rows.LOG + j] + items[rows.CHANGE + j] * place) if params.leak_gain != 0.0 else 0.0
        leak_1 = next_leak(params, items[rows.MEAN + j], int(items[rows.PIXEL + j]), int(resets) + 1, current)
        reset_1_us = time_us + refractory_us
        # Whether it cannot fire again: it moves one way only, and not far enough.
        release = min((reset_1_us - start_us) / span_us, 1.0)
        reference_1 = level if refractory_us == 0.0 else crossing.value(c, release)
        one_way = crossing.slope(c, release) * crossing.slope(c, 1.0) > 0.0
        at_end = crossing.value(c, 1.0) - reference_1
        stays = one_way & (at_end + leak_1 * span_us < on - _SAFE) & (at_end > _SAFE - off)
        held = (refractory_us > 0.0) & (reset_1_us > end_us)
        over = held | stays
        items[rows.STATUS + j] = _FINISHED if (not noisy) & (over | (not fired)) else (_AGAIN if fired else _NOISY)
        reference_1 = np.nan if held | ((refractory_us > 0.0) & (noisy | (not stays))) else reference_1
        items[rows.REFERENCE + j] = reference_1 if fired else reference
        items[rows.RESET_US + j] = reset_1_us if fired else reset_us
        items[rows.LEAK + j] = leak_1 if fired else leak
        items[rows.TIME_US + j], items[rows.NEXT_LEAK + j] = time_us, leak_1
        items[rows.RESETS + j] = resets + (1.0 if fired else 0.0)
        items[rows.AT + j] = place


@compiled(error_model="numpy", _nrt=False)
def advance(items: np.ndarray, number: int, params: Parameters, noise_process: np.ndarray) -> None:
    count = rows.whole_vectors(number)
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
    span: rows.Span,
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
        pixel, status = int(items[rows.PIXEL + j]), items[rows.STATUS + j]
        sign, cause = items[rows.SIGN + j], int(items[rows.CAUSE + j])
        time_us, end_us = items[rows.TIME_US + j], items[rows.END_US + j]
        if sign != 0.0:
            events[count, 0] = np.int64(math.floor(time_us + 0.5))
            events[count, 1] = _word(pixel, time_us, sign, cause, frames, span.frame)
            count += 1
            if math.isnan(items[rows.REFERENCE + j]):
                rows.pass_held_candidates(items, j, params, noise_process)
        next_us = min(items[rows.RESET_US + j], items[rows.CANDIDATE_US + j])
        held_on = math.isnan(items[rows.REFERENCE + j]) and next_us > span.end_us
        if status == _FINISHED and (items[rows.LEFT + j] == 1.0 or held_on):
            _put_back(items, j, epoch_us, last_us, pixels, params, scratch)
            continue
        rows.keep(items, j, kept)
        if status == _FINISHED:
            piece_us = end_us - items[rows.START_US + kept]
            items[rows.LEFT + kept] -= 1.0
            items[rows.START_US + kept] = end_us
            items[rows.LOG + kept] += items[rows.CHANGE + kept]
            items[rows.NOISE + kept] += items[rows.NOISE_RISE + kept]
            items[rows.CURRENT_0 + kept] = items[rows.CURRENT_1 + kept]
            items[rows.LAG_0 + kept] = items[rows.LAG_1 + kept]
            if items[rows.LEFT + kept] == np.inf:  # all that is left, of which the next piece takes its share
                rest = (span.end_us - end_us) / piece_us
                items[rows.CHANGE + kept] *= rest
                items[rows.NOISE_RISE + kept] *= rest
            rows.begin_piece(items, kept, span.end_us, params)
            if math.isnan(items[rows.REFERENCE + kept]):
                rows.pass_held_candidates(items, kept, params, noise_process)
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
        if items[rows.STATUS + j] == _NOISY:
            pixel = int(items[rows.PIXEL + j])
            items[rows.DRAWN + count], items[rows.NUMBER + count] = pixel, noise_process[pixel, fields.CANDIDATES]
            items[rows.RATE + count] = noise_process[pixel, fields.RATE]
            items[rows.HOT + count] = noise_process[pixel, fields.HOT_SHARE]
            items[rows.SHARE + count] = noise_process[pixel, fields.ON_SHARE]
            items[rows.CURRENT + count] = items[rows.LOG + j] + items[rows.CHANGE + j] * items[rows.PLACE + j]
            noise_process[pixel, fields.CANDIDATES] += 1.0
            count += 1
    for k in range(rows.whole_vectors(count)):
        pixel, candidate = int(items[rows.DRAWN + k]), int(items[rows.NUMBER + k])
        current = exp(items[rows.CURRENT + k])
        _, pick, chance, side = uniforms(params.seed, pixel, CANDIDATE, candidate)
        wait, _, _, _ = uniforms(params.seed, pixel, CANDIDATE, candidate + 1)
        hot = pick < items[rows.HOT + k]
        fired = hot | (chance < max(params.shot_dark - params.shot_slope * current, params.shot_least))
        sign = 1.0 if hot | (side < items[rows.SHARE + k]) else -1.0
        items[rows.WAIT + k] = -ln(wait) / items[rows.RATE + k]
        items[rows.HOT + k], items[rows.SHARE + k] = HOT if hot else SHOT, sign if fired else 0.0
    count = 0
    for j in range(number):
        if items[rows.STATUS + j] == _NOISY:
            _take_candidate(items, j, items[rows.SHARE + count], items[rows.WAIT + count], params.refractory_us)
            items[rows.CAUSE + j] = items[rows.HOT + count]
            count += 1


@compiled(error_model="numpy", forceinline=True, _nrt=False)
def _take_candidate(items: np.ndarray, j: int, sign: float, wait_us: float, refractory_us: float) -> None:
    """Set an item's event at its noise candidate, and when the next one comes; sign: of the event, 0: none."""
    c, place = _polynomial(items, j), items[rows.PLACE + j]
    end_us, time_us = items[rows.END_US + j], items[rows.CANDIDATE_US + j]
    items[rows.TIME_US + j], items[rows.SIGN + j], items[rows.CANDIDATE_US + j] = time_us, sign, time_us + wait_us
    if sign != 0.0:
        items[rows.RESET_US + j] = time_us + refractory_us
        items[rows.REFERENCE + j] = crossing.value(c, place) if refractory_us == 0.0 else np.nan
        items[rows.RESETS + j] += 1.0
        items[rows.LEAK + j] = items[rows.NEXT_LEAK + j]
    distance = crossing.value(c, 1.0) - items[rows.REFERENCE + j]
    drift = items[rows.LEAK + j] * (end_us - items[rows.RESET_US + j])
    stays = distance + drift < items[rows.ON + j] - _SAFE and distance > _SAFE - items[rows.OFF + j]
    one_way = crossing.slope(c, place) * crossing.slope(c, 1.0) > 0.0
    items[rows.STATUS + j] = _FINISHED if stays and one_way and time_us + wait_us > end_us else _AGAIN


@compiled(error_model="numpy", forceinline=True, _nrt=False)
def _put_back(
    items: np.ndarray, j: int, epoch_us: float, last_us: float, pixels: Pixels, params: Parameters, scratch: Scratch
) -> None:
    """Write an item's state, and the bounds that follow from it; last_us: time of the last frame."""
    state, values = pixels.state, scratch.values
    pixel, k = int(items[rows.PIXEL + j]), int(items[rows.PLACE_IN_TILE + j])
    state[pixel, fields.REFERENCE], state[pixel, fields.RESET_US] = items[rows.REFERENCE + j], items[rows.RESET_US + j]
    state[pixel, fields.LEAK_SLOPE], state[pixel, fields.RESETS] = items[rows.LEAK + j], items[rows.RESETS + j]
    state[pixel, fields.CANDIDATE_US] = items[rows.CANDIDATE_US + j]
    high, low, slope, due_us = bounds(pixel, state, epoch_us)
    values[screen.SLOPE + k], values[screen.DUE + k] = slope, due_us
    if due_us <= last_us - epoch_us:
        scratch.due[0] = 1
    if params.photoreceptor_noise == 0.0:
        values[screen.HIGH + k], values[screen.LOW + k] = high, low
        single_us = np.float32(last_us - epoch_us)
        middle, half = screen.middle_and_half(np.float32(high), np.float32(low), np.float32(slope), single_us)
        values[screen.MIDDLE + k], values[screen.HALF + k] = middle, half
        values[screen.OFFSET + k] = middle - (items[rows.LOG + j] + items[rows.CHANGE + j])
    else:
        # The scratch values are narrowed by the noise of this very interval.
        pixels.screen[HIGH, pixel], pixels.screen[LOW, pixel] = high, low
