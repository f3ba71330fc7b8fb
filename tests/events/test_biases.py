import math
from pathlib import Path

import numpy as np
import pytest

from evslip.events.biases import (
    BIAS_SETS,
    DAVIS346_BIASES,
    circuit,
    currents,
    parse_biases,
    pixel_parameters,
)
from evslip.events.camera import EventCamera
from evslip.events.datasheet import bias_sheet, bias_table
from evslip.events.presets import PRESETS
from evslip.utils.errors import ConfigError

PAGE = Path(__file__).resolve().parents[2] / "docs" / "reference" / "cameras.md"
BASE = PRESETS["davis346"]
PER_E_FOLD = 1 / 14


def test_codes_are_the_currents_of_libcaer():
    # caerBiasCoarseFineToCurrent, in whole pA.
    whole_pico = {(7, 255): 24_800_000, (4, 39): 7408, (4, 1): 190, (2, 58): 172, (1, 16): 6, (4, 25): 4749}
    for code, pico in whole_pico.items():
        assert round(1e12 * currents({"PrBp": code})["PrBp"]) == pico


@pytest.mark.parametrize("biases", BIAS_SETS.values(), ids=BIAS_SETS)
def test_thresholds_are_those_that_jaer_shows(biases):
    # jAER has its own scale of currents (389 nA at its coarse code 2, which is 5 here) and negative OFF thresholds.
    def jaer_a(coarse, fine):
        return 389e-9 * 8.0 ** (coarse - 5) * fine / 256

    on, off, diff = (jaer_a(*biases[name]) for name in ("OnBn", "OffBn", "DiffBn"))
    factor = 0.7 / (0.7 * 0.7) / 20
    found = circuit(biases)
    assert found.theta_on == pytest.approx(factor * math.log(on / diff), abs=5e-4)
    assert -found.theta_off == pytest.approx(factor * math.log(off / diff), abs=5e-4)
    assert found.refractory_us == pytest.approx(1e6 * 20e-15 * (1.8 - 1.0) / jaer_a(*biases["RefrBp"]), rel=5e-3)


def test_default_thresholds_are_28_and_26_percent():
    found = circuit({})
    assert (found.theta_on, found.theta_off) == pytest.approx((0.283, 0.262), abs=1e-3)


def test_a_doubled_current_moves_thresholds_by_ln_2():
    amperes = currents({})
    once, doubled = circuit({}), circuit({name: 2 * amperes[name] for name in ("OnBn", "OffBn")})
    assert doubled.theta_on - once.theta_on == pytest.approx(PER_E_FOLD * math.log(2))
    assert doubled.theta_off - once.theta_off == pytest.approx(-PER_E_FOLD * math.log(2))
    # A common factor, such as a warmer bias generator's, changes neither.
    warm = circuit({name: 1.3 * amperes[name] for name in ("OnBn", "OffBn", "DiffBn")})
    assert warm[:2] == pytest.approx(once[:2])


def test_more_current_is_faster():
    amperes = currents({})
    for name, quantity, sign in (
        ("PrSFBp", "follower_hz", 1),
        ("PrBp", "amplifier_hz", 1),
        ("RefrBp", "refractory_us", -1),
    ):
        once, doubled = circuit({}), circuit({name: 2 * amperes[name]})
        assert getattr(doubled, quantity) / getattr(once, quantity) == pytest.approx(2.0**sign)
        assert sum(a != b for a, b in zip(once, doubled, strict=True)) == 1


def test_the_slowest_pole_counts():
    by_lux = [pixel_parameters(circuit({}, lux), BASE) for lux in (1, 30, 300, 3000)]
    assert by_lux[0]["cutoff_hz"] == pytest.approx(3.0) and by_lux[1]["cutoff_hz"] == pytest.approx(90.0)
    assert by_lux[2]["cutoff_hz"] == by_lux[3]["cutoff_hz"] == pytest.approx(286.3, abs=0.1)
    # In dim light the corner goes with light, down to that of the dark current.
    assert by_lux[0]["cutoff_dark"] == by_lux[1]["cutoff_dark"] == BASE.dark
    assert by_lux[2]["cutoff_dark"] < by_lux[3]["cutoff_dark"] < 1.0
    starved = pixel_parameters(circuit({"PrBp": 1e-12}), BASE)
    assert starved["cutoff_hz"] == circuit({"PrBp": 1e-12}).amplifier_hz


@pytest.mark.parametrize("lux", [150.0, 400.0, 1000.0, 5000.0])
def test_the_corner_by_light_is_the_nearest_line(lux):
    found = circuit({}, lux)
    values = pixel_parameters(found, BASE)
    light = (np.arange(20_000) + 0.5) / 20_000
    lowest = np.minimum(found.follower_hz, found.photoreceptor_hz * light) / values["cutoff_hz"]
    # 1 - e (1 - light), with e by least squares.
    steepness = ((1.0 - lowest) * (1.0 - light)).sum() / ((1.0 - light) ** 2).sum()
    assert values["cutoff_dark"] == pytest.approx(1.0 - steepness, abs=1e-4)


def test_leak_goes_against_the_threshold():
    sensitive, default = (pixel_parameters(circuit(BIAS_SETS[name]), BASE) for name in ("high sensitivity", "default"))
    assert sensitive["leak_rate_hz"] * sensitive["theta_on"] == pytest.approx(BASE.leak_rate_hz * BASE.theta)
    assert sensitive["leak_rate_hz"] > default["leak_rate_hz"]


def test_a_camera_from_biases_sees_what_its_thresholds_let_it():
    def events_at(name, change):
        camera = EventCamera.from_biases(BIAS_SETS[name], "clean", size=(16, 16), white_lux=1e5, sigma=0.0)
        image = np.full((16, 16), 0.5)
        frames = [(0.0, image), (1000.0, image * math.exp(change)), (1e5, image * math.exp(change))]
        return camera.run(frames)

    for change in (0.2, -0.2):
        assert events_at("default", change).count == 0
        seen = events_at("high sensitivity", change)
        assert seen.count >= 256 and (seen.p == (change > 0)).all()
    assert EventCamera.from_biases(size=(4, 4), theta_on=0.5).model.theta_on == 0.5
    assert (EventCamera.from_biases(size=(4, 4), theta=0.5, sigma=0.0).theta_on == 0.5).all()
    assert EventCamera.from_biases(size=(4, 4), mode="v2e").model.theta_on == pytest.approx(0.283, abs=1e-3)


@pytest.mark.parametrize(
    ("biases", "words"),
    [
        ({"OnBias": (5, 255)}, "OnBias.*OnBn"),
        ({"OnBn": (8, 255)}, "OnBn.*0 to 7"),
        ({"OnBn": (5, 256)}, "OnBn.*0 to 255"),
        ({"OnBn": (5, 25.5)}, "OnBn.*whole"),
        ({"OnBn": (5,)}, "OnBn.*coarse, fine"),
        ({"OffBn": (4, 0)}, "OffBn.*1 to 255"),
        ({"PrBp": -1e-12}, "PrBp.*more than 0"),
        ({"PrBp": 170}, "PrBp.*2.48e-05"),
        ({"PrBp": math.nan}, "PrBp"),
        ({"PrBp": "2/58"}, "PrBp.*amperes"),
        ({"PrBp": True}, "PrBp"),
        ({"OnBn": (4, 40)}, "OnBn.*above DiffBn"),
        ({"OffBn": (5, 5)}, "OffBn.*below DiffBn"),
    ],
)
def test_wrong_biases_are_refused_by_name(biases, words):
    with pytest.raises(ConfigError, match=words):
        EventCamera.from_biases(biases)


def test_wrong_light_is_refused():
    for lux in (0.0, -1.0, math.nan, math.inf, True):
        with pytest.raises(ConfigError, match="white_lux"):
            circuit({}, lux)


def test_names_may_be_spelt_as_other_drivers_do():
    assert currents({"ONBn": (5, 26), "offbn": (4, 10)}) == currents(BIAS_SETS["high sensitivity"])


def test_texts_become_biases():
    assert parse_biases(("OnBn=5/255", "PrBp=1.7e-10")) == {"OnBn": (5, 255), "PrBp": 1.7e-10}
    for text in ("OnBn", "OnBn=", "OnBn=a/b", "OnBn=1/2/3", "OnBn=5/"):
        with pytest.raises(ConfigError, match=text):
            parse_biases((text,))


def test_a_sheet_names_every_bias_and_quantity():
    lines = bias_sheet({}, 1000.0).splitlines()
    assert [line.split()[0] for line in lines[:6]] == list(DAVIS346_BIASES)
    assert any(line.startswith("ON threshold") and "+32.7 %" in line for line in lines)


def test_the_documented_sets_are_those_of_the_code():
    assert bias_table(BASE, 1000.0) in PAGE.read_text(), "put the output of `evslip show camera --biases` there"
