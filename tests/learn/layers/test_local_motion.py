"""Local motion of edges that move, tremble, or flash."""

import numpy as np
import pytest

from evslip.learn.layers.local_motion import AGES_US, UNIT_US, local_motion
from evslip.windows.window_events import WindowEvents
from learn_windows import random_window

SIZE, POOL, RECENT_US = (40, 30), 5, 80_000


def edge(columns: np.ndarray, step_us: int, start_us: int = 0) -> WindowEvents:
    """An upright edge that is in each of some columns, one after another."""
    rows = np.arange(SIZE[1])
    t_us = start_us + np.arange(len(columns)).repeat(len(rows)) * step_us
    x = columns.repeat(len(rows))
    y = np.tile(rows, len(columns))
    return WindowEvents(t_us.astype(np.uint32), x.astype(np.uint8), y.astype(np.uint8), np.ones(len(x), bool))


def found(events: WindowEvents) -> np.ndarray:
    """Sums over the picture, (2, bands, 2)."""
    return local_motion(events, SIZE, RECENT_US, POOL).sum((3, 4))


@pytest.mark.parametrize(("step_us", "band"), [(2_000, 0), (15_000, 1), (30_000, 2), (70_000, 3)])
def test_an_edge_lands_in_the_band_of_its_speed_with_the_sign_of_its_way(step_us: int, band: int) -> None:
    there = np.arange(10, 13)
    right, left = found(edge(there, step_us)), found(edge(there[::-1], step_us))
    along = right.sum(0)[:, 0]
    assert along[band] == 2 * SIZE[1] and along.sum() == along[band]
    np.testing.assert_array_equal(left[:, :, 0], -right[:, :, 0])


def test_before_and_after_the_recent_part() -> None:
    early, late = edge(np.arange(5, 9), 1000), edge(np.arange(5, 9), 1000, RECENT_US)
    assert found(early)[0, 0, 0] > 0 and not found(early)[1].any()
    assert found(late)[1, 0, 0] > 0 and not found(late)[0].any()


def test_a_trembling_edge_cancels_and_a_flash_has_no_way() -> None:
    there = np.arange(10, 16)
    trembling = np.concatenate([there, there[-2::-1]] * 4)
    steady = np.arange(0, 36)
    assert abs(found(edge(trembling, 1000))[0, 0, 0]) < 0.15 * abs(found(edge(steady, 1000))[0, 0, 0])
    for step_us in (0, 10):  # a picture that flashes, read out column by column
        assert not found(edge(np.arange(SIZE[0]), step_us)).any()


def test_events_of_any_kind_equal_those_counted_one_by_one() -> None:
    events = random_window(3, 4000, *SIZE)
    expected = np.zeros((2, len(AGES_US), 2, 6, 8))
    last: dict[tuple[int, int, bool], int] = {}
    for t, x, y, p in zip(*(column.tolist() for column in events.columns), strict=True):
        for axis, (dx, dy) in enumerate(((1, 0), (0, 1))):
            for sign in (-1, 1):
                before = last.get((x + sign * dx, y + sign * dy, p))
                age = 0 if before is None else (t - before) // UNIT_US * UNIT_US
                if 0 < age < AGES_US[-1]:
                    band = int(np.searchsorted(AGES_US, age, "right"))
                    expected[int(t >= RECENT_US), band, axis, y // POOL, x // POOL] -= sign
        last[x, y, p] = t
    np.testing.assert_array_equal(local_motion(events, SIZE, RECENT_US, POOL), expected)
