"""What is known of windows, of made-up trajectories."""

import numpy as np
import pytest

from evslip.config.loading import load_config
from evslip.data.record import Record
from evslip.draws.draw import draw
from evslip.events.stream import empty_events
from evslip.physics.motion.phases import PHASE_NAMES
from evslip.physics.truth import Truth
from evslip.windows.conditions import NO_PHASE, conditions, lamp_direction, light_ratio
from made_up import still, turning

CONFIG = load_config("demo", {"light.polar_deg": 0.0, "light.azimuth_deg": 0.0, "motion.duration_s": 7.5})
PARAMS = draw(CONFIG, 0)
STARTS = np.array([0, 300_000, 800_000])
LENGTH_US = 160_000


def record_of(trajectory, **truth) -> Record:
    n = len(trajectory.t_us)
    rotation = np.tile([1.0, 0, 0, 0], (n, 1))
    values = {
        "theta_deg": np.zeros(n),
        "rotation": rotation,
        "position_m": np.zeros((n, 3)),
        "held": np.ones(n, bool),
        "span_us": (0, 1000 * (n - 1)),
        "onset_us": None,
        **truth,
    }
    return Record(
        kind="simulated",
        name="a",
        size=(346, 260),
        events=empty_events(),
        params=trajectory.params,
        trajectory=trajectory,
        truth=Truth(trajectory.t_us, **values),
    )


def test_nothing_moves_when_nothing_moves() -> None:
    found = conditions(record_of(still(PARAMS)), STARTS, LENGTH_US)
    assert found.arm_speed_m_s.tolist() == [0, 0, 0]
    assert found.light_turn_deg == pytest.approx(0, abs=1e-4)
    assert not found.shading.any()
    assert (found.since_onset_deg == 0).all() and (found.phase == NO_PHASE).all()


def test_the_arm_s_speed_and_the_lamp_s_turn_are_those_of_the_motion() -> None:
    # The hand goes 0.1 m and tilts by 0.4 rad about world y within 1 s, as the square of time; the lamp is overhead.
    found = conditions(record_of(turning(PARAMS)), STARTS, LENGTH_US)
    grown = ((STARTS / 1e6 + 0.16) ** 2) - (STARTS / 1e6) ** 2
    assert found.arm_speed_m_s == pytest.approx(0.1 * grown / 0.16, rel=1e-3)
    assert found.light_turn_deg == pytest.approx(np.degrees(0.4) * grown, rel=1e-3)


def test_the_light_s_ratio_is_that_of_illuminances() -> None:
    light, surroundings = PARAMS.light, PARAMS.background.luminance_cd_m2
    lux = np.pi * light.luminance_cd_m2 * light.radius_m**2 / light.distance_m**2
    assert light_ratio(PARAMS) == pytest.approx(lux / (np.pi * surroundings))
    assert lamp_direction(light).tolist() == pytest.approx([0, 0, 1])


def test_how_far_a_slip_has_gone_counts_from_its_onset() -> None:
    n = 1001
    half = np.radians(np.linspace(0, 100, n)) / 2  # 0.1 degrees a millisecond
    rotation = np.column_stack([np.cos(half), np.zeros(n), np.sin(half), np.zeros(n)])
    position = np.column_stack([np.zeros((n, 2)), np.linspace(0, 0.01, n)])
    record = record_of(still(PARAMS), rotation=rotation, position_m=position, onset_us=400_000)
    found = conditions(record, STARTS, LENGTH_US)
    assert found.since_onset_deg == pytest.approx([0, 6, 56], abs=1e-5)
    assert found.since_onset_mm == pytest.approx([0, 0.6, 5.6], abs=1e-5)


def test_the_phase_is_that_of_the_window_s_middle() -> None:
    phase = np.full(1001, PHASE_NAMES.index("lift"), np.uint8)
    phase[400:] = PHASE_NAMES.index("tilt")
    found = conditions(record_of(still(PARAMS), phase=phase), np.array([300_000, 330_000]), LENGTH_US)
    assert [PHASE_NAMES[code] for code in found.phase] == ["lift", "tilt"]


def test_of_a_recording_nothing_is_known() -> None:
    record = Record(kind="recording", name="a", size=(346, 260), events=empty_events())
    found = conditions(record, STARTS, LENGTH_US)
    assert np.isnan(found.arm_speed_m_s).all() and np.isnan(found.light_ratio).all() and not found.shading.any()
