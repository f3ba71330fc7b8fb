"""Tables of a score of realism: a head and lines of texts, for the page and for a terminal."""

from collections.abc import Sequence

from evslip.learn.realism.cells import Agreement
from evslip.learn.realism.levels import NAMES
from evslip.learn.realism.realism import Realism
from evslip.learn.realism.timing import spectrum_distance_db
from evslip.view.report.page import number


def figure_table(found: Realism) -> list[list[str]]:
    """Head and lines: a line a figure, with the value of a perfect simulator and the floor."""
    tested = found.two_sample
    accuracy = "–" if tested is None else f"{100 * tested.accuracy:.1f} % ± {100 * tested.error:.1f}"
    return [
        ["", "simulated", "perfect", "two draws", "oracle of frames"],
        ["events, x real", number(found.fine.total, 2), "1", *_also(found.floor, "total"), "–"],
        ["L1/N, 4 x 4 pixels, 40 ms", number(found.fine.l1_per_event, 2), "0", *_also(found.floor, "l1_per_event"),
         *_also(found.oracle, "l1_per_event")],
        ["correlation", number(found.fine.correlation, 2), "1", *_also(found.floor, "correlation"),
         *_also(found.oracle, "correlation")],
        ["L1/N, 8 x 8 pixels, 80 ms", number(found.coarse.l1_per_event, 2), "0",
         *_also(found.floor_coarse, "l1_per_event"), "–"],
        ["correlation", number(found.coarse.correlation, 2), "1", *_also(found.floor_coarse, "correlation"), "–"],
        ["intervals at a pixel: KS", number(found.ks, 2), "0",
         "–" if found.ks_floor is None else number(found.ks_floor, 2), "–"],
        ["two-sample test: accuracy", accuracy, "50 %", "–", "–"],
        ["spectrum of the rate, dB", number(spectrum_distance_db(*found.spectrum[1:]), 1), "0", "–", "–"],
    ]  # fmt: skip


def side_table(found: Realism) -> list[list[str]]:
    """Head and lines: real and simulated figures beside one another."""
    return [
        ["", "real", "simulated"],
        ["events", *(f"{count:,}" for count in found.events)],
        ["share of ON", *map(number, found.on_share)],
        ["variance over mean of the pixels' counts", *(number(value, 2) for value in found.variance_over_mean)],
    ]


def level_table(found: Realism) -> list[list[str]]:
    """Head and lines: a line a level of light; empty without frames."""
    if found.levels is None:
        return []
    real, simulated = found.levels
    lines = [
        [
            name,
            f"{real.pixel_s[i]:,.0f}",
            number(real.rate_hz[i], 4),
            number(simulated.rate_hz[i], 4),
            number(real.on_share[i]),
            number(simulated.on_share[i]),
        ]
        for i, name in enumerate(NAMES)
    ]
    return [["light, 0 to 255", "pixel seconds", "Hz a pixel: real", "simulated", "ON: real", "simulated"], *lines]


def _also(agreement: Agreement | None, name: str) -> Sequence[str]:
    return ["–" if agreement is None else number(getattr(agreement, name), 2)]
