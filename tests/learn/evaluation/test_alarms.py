"""Alarms of made-up answers, counted by hand."""

import numpy as np
import pytest

from evslip.learn.evaluation import alarms
from evslip.learn.evaluation.groups import groupings
from evslip.learn.evaluation.predictions import Predictions, Track
from evslip.learn.scores.bootstrap import draws
from evslip.windows.conditions import Conditions
from evslip.windows.label import Label
from evslip.windows.window_set import WindowSettings

LENGTH_US, HOP_US = 160_000, 20_000


def answers_of(*trajectories: tuple[str, str], onsets: tuple[int | None, ...]) -> Predictions:
    """Trajectories of (labels, answers), a sign a hop: h, s or b (between) and the probability in tenths. `onsets` are
    the hops whose window ends at the first slip's onset; slips end 0.4 s after it."""
    tracks, parts = [], []
    row = 0
    for number, ((labels, told), onset) in enumerate(zip(trajectories, onsets, strict=True)):
        n = len(labels)
        assert n == len(told)
        onset_us = None if onset is None else onset * HOP_US + LENGTH_US
        end_us = None if onset_us is None else onset_us + 400_000
        tracks.append(Track(f"t{number}", slice(row, row + n), onset_us, end_us))
        parts.append((labels, told, np.full(n, number), np.arange(n) * HOP_US))
        row += n
    code = {"h": Label.HOLD, "s": Label.SLIP, "b": Label.UNCERTAIN}
    label = np.array([code[c] for labels, *_ in parts for c in labels])
    p_slip = np.array([int(c) / 10 for _, told, *_ in parts for c in told])
    track, start_us = (np.concatenate([part[i] for part in parts]) for i in (2, 3))
    conditions = Conditions.unknown(row)
    onset_of = np.array([t.onset_us if t.onset_us is not None else 10**9 for t in tracks])[track]
    late_s = np.maximum(start_us + LENGTH_US - onset_of, 0) / 1e6
    conditions.since_onset_deg[:] = 50 * late_s
    conditions.since_onset_mm[:] = 2 * late_s
    return Predictions(
        p_slip=p_slip,
        label=label,
        counted=np.arange(row) % 8 == 0,
        track=track,
        start_us=start_us,
        rotation_deg=np.zeros(row),
        translation_mm=np.zeros(row),
        speeds=np.full((row, 2), np.nan),
        estimates=np.full((row, 4), np.nan),
        recent=np.zeros(row, bool),
        events=np.zeros(row, int),
        object_events=np.zeros(row, int),
        conditions=conditions,
        tracks=tuple(tracks),
        length_us=LENGTH_US,
        hop_us=HOP_US,
    )


def test_a_slip_is_detected_with_its_latency() -> None:
    found = alarms.alarms_at(answers_of(("hhhhhhhssssss", "0000000009999"), onsets=(6,)), 0.5)
    assert (found.detected, found.slips, found.false_alarms) == (1, 1, 0)
    assert found.latency_s.tolist() == pytest.approx([0.06])
    assert found.slipped_deg.tolist() == pytest.approx([3.0])
    assert found.slipped_mm.tolist() == pytest.approx([0.12])
    assert found.holding_min == pytest.approx(7 * 0.02 / 60)


def test_an_alarm_shortly_before_the_onset_detects_and_one_long_before_is_false() -> None:
    early = alarms.alarms_at(answers_of(("hhhhhhhsssss", "000009999999"), onsets=(7,)), 0.5)
    assert (early.detected, early.false_alarms, early.latency_s[0]) == (1, 0, pytest.approx(-0.04))
    assert early.slipped_deg[0] == 0
    standing = alarms.alarms_at(answers_of(("hhhhhhhhhhhhsss", "099999999999999"), onsets=(11,)), 0.5)
    assert (standing.detected, standing.false_alarms) == (0, 1)
    assert standing.latency_s[0] == np.inf


def test_runs_less_than_a_fifth_of_a_second_apart_are_one_alarm() -> None:
    near = answers_of(("h" * 30, "09" + "0" * 9 + "9" + "0" * 18), onsets=(None,))
    far = answers_of(("h" * 30, "09" + "0" * 10 + "9" + "0" * 17), onsets=(None,))
    assert alarms.alarms_at(near, 0.5).false_alarms == 1
    assert alarms.alarms_at(far, 0.5).false_alarms == 2
    # Of two trajectories, never.
    assert alarms.alarms_at(answers_of(("hh", "09"), ("hh", "90"), onsets=(None, None)), 0.5).false_alarms == 2


def test_alarms_that_begin_between_hold_and_slip_are_neither_right_nor_false() -> None:
    found = alarms.alarms_at(answers_of(("hhbbbbhh", "00099000"), onsets=(None,)), 0.5)
    assert (found.false_alarms, found.slips) == (0, 0)
    assert np.isnan(found.detection_rate)


def test_an_alarm_after_the_slip_has_left_the_window_is_too_late() -> None:
    # The onset is hop 0, the slip ends 20 hops later and has left the window after 28.
    labels = "s" * 28 + "h" * 12
    in_time, late = ("0" * hop + "9" + "0" * (39 - hop) for hop in (28, 29))
    assert alarms.alarms_at(answers_of((labels, in_time), onsets=(0,)), 0.5).detected == 1
    found = alarms.alarms_at(answers_of((labels, late), onsets=(0,)), 0.5)
    assert (found.detected, found.false_alarms) == (0, 1)


def test_the_allowed_threshold_is_the_lowest_down_to_which_the_rate_is_kept() -> None:
    # One minute of holding. At 0.7 one false alarm; at 0.5 two; at 0.3 all is one alarm, but that is no merit.
    told = ["3"] * 3000
    told[500], told[1500] = "7", "5"
    slip = ("hhhhhsssss", "0000000666")
    found = answers_of(("h" * 3000, "".join(told)), slip, onsets=(None, 4))
    best = alarms.at_allowed_rate(alarms.sweep(found))
    assert (best.false_alarms, best.detected) == (1, 1)
    assert 0.5 < best.threshold <= 0.6
    assert alarms.alarms_at(found, 0.3).false_alarms == 1
    strict = alarms.at_allowed_rate(alarms.sweep(found), per_min=0.5)
    assert (strict.false_alarms, strict.detected) == (0, 0)


def test_a_missed_slip_counts_as_infinitely_late() -> None:
    assert alarms.quantile(np.array([0.1, 0.2, np.inf]), 0.5) == 0.2
    assert alarms.quantile(np.array([0.1, np.inf, np.inf]), 0.5) == np.inf
    assert alarms.quantile(np.array([0.1, 0.2, 0.3, 0.4]), 0.95) == 0.4
    assert np.isnan(alarms.quantile(np.empty(0), 0.5))


def test_groups_hold_every_counted_window_once() -> None:
    rng = np.random.default_rng(0)
    labels = "".join(rng.choice(list("hsb"), 800))
    told = "".join(str(d) for d in rng.integers(0, 10, 800))
    found = answers_of((labels[:400], told[:400]), (labels[400:], told[400:]), onsets=(None, None))
    found.rotation_deg[:] = rng.exponential(1, 800)
    found.recent[:] = rng.random(800) < 0.3
    by = {g.name: g for g in groupings(found, WindowSettings(), 0.5, draws(2, 50))}
    assert set(by) >= {"turning_deg_s", "sliding_mm_s", "events", "object_events", "flags"}
    assert "phase" not in by and "light_ratio" not in by  # nobody knows them here
    turning = by["turning_deg_s"].groups
    assert sum(group.windows for group in turning) == found.counted.sum() == 100
    assert all(group.windows == group.slips + group.holds + group.between for group in turning)
    flags = {group.name: group for group in by["flags"].groups}
    assert flags["all"].windows == flags["not just after a slip"].windows + flags["just after a slip"].windows
    clear = found.counted & (found.label != Label.UNCERTAIN)
    right = (found.p_slip >= 0.5) == (found.label == Label.SLIP)
    assert flags["all"].accuracy == pytest.approx(right[clear].mean())
    between = found.counted & (found.label == Label.UNCERTAIN)
    assert flags["all"].between_said_slip == pytest.approx((found.p_slip[between] >= 0.5).mean())
