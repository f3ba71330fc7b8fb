import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evslip.config.distributions import Uniform
from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.draws.draw_plan import make_plan
from evslip.draws.separation import separate
from evslip.draws.splits import Dimension, divide
from evslip.utils.errors import ConfigError

TEXTURES = ("object.texture", "surface.texture", "background.texture")
LIMITS = {
    "object.width_m": (0.03, 0.07),
    "object.height_m": (0.06, 0.11),
    "object.mass_kg": (0.01, 0.1),
    "light.distance_m": (20.0, 40.0),
}
NUMBERS = tuple(LIMITS)


@st.composite
def atoms(draw_, low, high):
    """A constant or a range, which may be as narrow as two neighbouring numbers."""
    first = draw_(st.floats(low, high))
    if draw_(st.booleans()):
        return first
    width = draw_(st.sampled_from(["one", "two", "some"]))
    last = math.nextafter(first, math.inf) if width == "one" else first
    last = math.nextafter(math.nextafter(first, math.inf), math.inf) if width == "two" else last
    last = draw_(st.floats(first, high)) if width == "some" else last
    return {"min": first, "max": last} if last > first else first


@st.composite
def configurations(draw_):
    changes = {"sampling": draw_(st.sampled_from(["grid", "random"])), "test_share": draw_(st.floats(0.05, 0.9))}
    changes["seed"] = draw_(st.integers(0, 9))
    for key in NUMBERS:
        atom = atoms(*LIMITS[key])
        changes[key] = draw_(st.lists(atom, min_size=1, max_size=5) if draw_(st.booleans()) else atom)
    names = st.sampled_from([f"wood-{i}" for i in range(6)] + ["stone-*", "brick-1"])
    for key in TEXTURES:
        changes[key] = draw_(st.lists(names, min_size=1, max_size=4) | names)
    lists = [k for k in (*NUMBERS, *TEXTURES) if isinstance(changes[k], list) and "stone-*" not in changes[k]]
    group = [k for k in lists if len(changes[k]) == len(changes[lists[0]])] if lists else []
    changes["together"] = [group] if draw_(st.booleans()) else []
    return changes


@given(configurations())
@settings(max_examples=60)
def test_no_configuration_shares_a_value_between_the_splits(changes):
    try:
        config = load_config("complex", changes)
        found = separate(config, {"train": 25, "test": 25})
    except ConfigError as error:
        assert "too few values" in str(error) or "too narrow" in str(error)
        return
    assert found.shared() == {}


def test_a_side_that_follows_from_another_one_is_not_compared():
    # A cylinder is as wide as it is deep; with this seed some depths of training are widths of testing.
    sides = [0.03, 0.035, 0.04, 0.045, 0.05]
    lists = {"object.shape": ["cuboid", "cylinder"], "object.width_m": sides, "object.depth_m": sides, "seed": 1}
    found = separate(load_config("complex", lists), {"train": 60, "test": 40})
    assert found.shared() == {}
    assert all(found.values["object.width_m"].values())


def test_the_check_finds_what_is_shared(monkeypatch):
    """With a split that does not divide, the check must say so: otherwise it proves nothing."""
    monkeypatch.setattr(Dimension, "tokens", lambda self: [set() for _ in self.rows])
    config = load_config("complex", {"seed": 77, "grip.force_n": [0.9, 1.0, 1.1]})
    shared = separate(config, {"train": 60, "test": 60}).shared()
    assert "texture" in shared and "grip.force_n" in shared
    assert "object.mass_kg" not in shared


@given(st.floats(0, 1), st.floats(0, 1), st.integers(0, 10**6))
def test_draws_of_ranges_never_meet_whatever_the_ranges(low, width, seed):
    high = low + width
    if not high > low:
        return
    one, other = Uniform(min=low, max=high), Uniform(min=low, max=min(1.5 * high, 2.0) if high > 0 else high)
    rng = np.random.default_rng(seed)
    even = {one.draw(rng, False) for _ in range(20)} | {other.draw(rng, False) for _ in range(20)}
    odd = {one.draw(rng, True) for _ in range(20)} | {other.draw(rng, True) for _ in range(20)}
    assert not even & odd
    assert all(low <= value <= max(high, other.max) for value in even | odd)


def test_a_range_avoids_the_constants_beside_it_or_says_that_it_cannot():
    rng = np.random.default_rng(0)
    low, high = 1.0, math.nextafter(1.0, 2.0)
    both = Uniform(min=low, max=high)
    assert {both.draw(rng, False), both.draw(rng, True)} == {low, high}
    with pytest.raises(ConfigError, match="too narrow"):
        both.draw(rng, False, {low})
    wider = Uniform(min=low, max=math.nextafter(math.nextafter(high, 2.0), 2.0))
    assert {wider.draw(rng, False, {low}) for _ in range(9)} == {math.nextafter(high, 2.0)}


def test_rows_that_share_a_constant_go_to_the_same_split():
    grouped = Dimension(("object.texture", "surface.texture"), (("a", "x"), ("b", "x"), ("c", "y"), ("d", "z")), False)
    alone = Dimension(("background.texture",), (("x",), ("y",), ("w",), ("q",)), False)
    for seed in range(20):
        shares = divide([grouped, alone], seed, 0.3)
        for split in ("train", "test"):
            rows = shares[split]
            assert (0 in rows[0]) == (1 in rows[0])
            mine = {str(name) for r in rows[0] for name in grouped.rows[r]} | {str(alone.rows[r][0]) for r in rows[1]}
            other = shares["test" if split == "train" else "train"]
            theirs = {str(name) for r in other[0] for name in grouped.rows[r]} | {
                str(alone.rows[r][0]) for r in other[1]
            }
            assert not mine & theirs


def test_a_short_list_of_textures_beside_the_whole_pool_is_divided_too():
    for seed in range(30):
        config = load_config("complex", {"seed": seed, "surface.texture": ["wood-0", "wood-1"]})
        seen = [draw(config, i, split).surface.texture for split in ("train", "test") for i in (0, 1, 2)]
        assert len(set(seen[:3])) == len(set(seen[3:])) == 1 and seen[0] != seen[3]


@pytest.mark.parametrize("share", [0.1, 0.2, 0.5])
def test_about_the_wanted_share_is_held_out_of_every_family(share):
    plan = make_plan(load_config("complex", {"test_share": share}))
    (dimension,) = (d for d in plan.dimensions if d.keys == ("background.texture",))
    rows = plan.shares["test"][plan.dimensions.index(dimension)]
    assert len(rows) == round(share * len(dimension.rows))
    families = [str(dimension.rows[row][0]).rpartition("-")[0] for row in rows]
    sizes = [str(row[0]).rpartition("-")[0] for row in dimension.rows]
    assert all(abs(families.count(f) - share * sizes.count(f)) <= 1 for f in set(sizes))


def test_kinds_belong_to_both_splits():
    config = load_config("complex", {"object.shape": ["cuboid", "cylinder"]})
    for split in ("train", "test"):
        assert {draw(config, i, split).object.shape for i in range(30)} == {"cuboid", "cylinder"}


def test_lists_that_go_together_walk_in_step():
    names = ["wood-0", "wood-1", "wood-2"]
    widths, keys = [0.03, 0.05, 0.07], ("object.texture", "object.width_m")
    for sampling in ("grid", "random"):
        lists = {"object.texture": names, "object.width_m": widths}
        config = load_config("simple", {"sampling": sampling, "together": [keys], **lists})
        pairs = {(p.object.texture, p.object.width_m) for p in (draw(config, i) for i in range(500))}
        assert pairs == set(zip(names, widths, strict=True))


@pytest.mark.parametrize(
    ("together", "words"),
    [
        ([["object.texture", "object.colour"]], "object.colour"),
        ([["object.texture", "object.texture"]], "twice"),
        ([["object.texture"], ["object.texture"]], "twice"),
        ([["object.texture", "grip.offset"]], "object.texture has 2 entries, grip.offset has 3"),
        ([["texture"]], "texture"),
        ("object.texture", "tuple"),
    ],
)
def test_wrong_groups_are_refused(together, words):
    with pytest.raises(ConfigError, match=words) as caught:
        load_config("simple", {"together": together})
    assert str(caught.value).startswith("simple: together")
