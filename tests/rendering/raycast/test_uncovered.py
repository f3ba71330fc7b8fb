"""Runs of pixels that the backdrop is drawn in."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evslip.rendering.raycast.layers import runs_between
from evslip.rendering.raycast.uncovered import Uncovered, due_runs
from evslip.rendering.scratch import BLOCK
from evslip.rendering.slots import SLOT
from evslip.rendering.timing.cell_motion import divide


@settings(max_examples=30)
@given(st.integers(0, 10**6), st.sampled_from([(60, 80), (104, 346), (97, 1384)]))
def test_every_pixel_that_is_due_and_seen_is_in_one_run(seed, shape):
    rng = np.random.default_rng(seed)
    hidden = np.zeros(shape, bool)
    for _ in range(3):
        top, left = rng.integers(0, shape)
        hidden[top : top + rng.integers(1, 60), left : left + rng.integers(1, 200)] = True
    cells = divide(*shape)
    slots = rng.integers(-1, 3, (cells.rows, cells.columns)).astype(np.int8)
    full = np.sort(rng.integers(0, shape[1], (shape[0], 2)), 1)
    uncovered = Uncovered(runs_between(hidden), np.zeros(shape, np.float32), full * 0, full)
    drawn = np.zeros(shape, int)
    for row, start, past, slot in due_runs(slots, cells, shape[1], uncovered):
        assert 0 < past - start <= SLOT
        assert slot == slots[row // cells.height, start // cells.width]
        drawn[row, start:past] += 1
    assert drawn.max() <= 1
    rows, columns = np.mgrid[: shape[0], : shape[1]]
    due = slots[rows // cells.height, columns // cells.width] >= 0
    inside = (columns > full[:, :1]) & (columns < full[:, 1:] - 1)
    assert np.all(drawn[due & ~hidden & ~inside] == 1) and np.all(drawn[~due] == 0)
    assert drawn[due & inside].sum() <= BLOCK * shape[0] * cells.columns + np.count_nonzero(due & inside & ~hidden)


@pytest.mark.parametrize("width", [640, 1384])
def test_no_run_is_longer_than_a_slot_where_cells_are_wider(width):
    shape = (16, width)
    cells = divide(*shape)
    assert cells.width > SLOT
    nothing = np.zeros((shape[0], 2), np.int64)
    uncovered = Uncovered(runs_between(np.zeros(shape, bool)), np.zeros(shape, np.float32), nothing, nothing)
    runs = due_runs(np.zeros((cells.rows, cells.columns), np.int8), cells, width, uncovered)
    assert (runs[:, 2] - runs[:, 1]).max() == SLOT and (runs[:, 2] - runs[:, 1]).sum() == shape[0] * width
