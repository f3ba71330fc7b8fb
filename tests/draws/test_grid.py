import itertools
import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from evslip.config.loading import load_config
from evslip.draws.draw import draw, grid_size
from evslip.draws.grid import places

SIZES = st.lists(st.integers(1, 7), max_size=5)


@given(SIZES, st.integers(0, 10**12))
@settings(max_examples=50)
def test_every_combination_comes_once_then_they_begin_again(sizes, start):
    number = math.prod(sizes)
    seen = [tuple(places(index, sizes)) for index in range(start, start + number)]
    assert sorted(seen) == list(itertools.product(*map(range, sizes)))
    assert places(start, sizes) == places(start + number, sizes)


@given(SIZES)
def test_the_first_index_has_the_first_entries(sizes):
    assert places(0, sizes) == [0] * len(sizes)


def deviation(flags: np.ndarray, share: float) -> float:
    """Over all numbers of first samples: how far their flags are from the share at most."""
    return float(np.abs(np.cumsum(flags) - share * np.arange(1, len(flags) + 1)).max())


def test_any_first_samples_of_the_simple_set_are_a_mixture():
    config = load_config("simple")
    drawn = [draw(config, index) for index in range(grid_size(config))]
    keys = {
        "width": [p.object.width_m for p in drawn],
        "height": [p.object.height_m for p in drawn],
        "mass": [p.object.mass_kg for p in drawn],
        "texture": [p.object.texture for p in drawn],
        "offset": [p.grip.offset for p in drawn],
        "depth": [p.grip.depth_m for p in drawn],
        "light": [p.light.azimuth_deg for p in drawn],
    }
    codes = {name: np.unique(np.array(values), return_inverse=True)[1] for name, values in keys.items()}
    for name, code in codes.items():
        for value in range(code.max() + 1):
            assert deviation(code == value, 1 / (code.max() + 1)) <= 2, name
    for (one, a), (other, b) in itertools.combinations(codes.items(), 2):
        for u, v in itertools.product(range(a.max() + 1), range(b.max() + 1)):
            share = 1 / ((a.max() + 1) * (b.max() + 1))
            assert deviation((a == u) & (b == v), share) <= 3.5, f"{one} does not follow {other}"
    heavy = codes["mass"] == 1
    assert not heavy[0] and heavy[:5].any()
