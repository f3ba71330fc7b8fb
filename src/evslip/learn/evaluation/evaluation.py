"""Evaluation of one detector."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from evslip.data.record import Record
from evslip.learn.checkpoint import Description, load_model
from evslip.learn.evaluation import alarms, predictions
from evslip.learn.evaluation.alarms import Alarms
from evslip.learn.evaluation.cost import Cost, measure_cost
from evslip.learn.evaluation.evaluation_data import EvaluationData
from evslip.learn.evaluation.groups import Grouping, groupings
from evslip.learn.evaluation.predictions import UNKNOWN, Predictions
from evslip.learn.inference import probabilities
from evslip.learn.networks.network import Geometry
from evslip.learn.scores import bootstrap, weighted
from evslip.learn.scores.metrics import Metrics, measure, measured
from evslip.learn.scores.speed import SpeedScores, speed_scores
from evslip.learn.speed_estimate import SpeedEstimate
from evslip.learn.training_facts import data_identity, slip_share
from evslip.utils.errors import ConfigError, DataError
from evslip.windows.alignment import require_sensor
from evslip.windows.label import Label
from evslip.windows.mixture import plain_name
from evslip.windows.settings import Align, in_whole_ms
from evslip.windows.window_set import Windows, WindowSettings

HOP_S = 0.02
CURVE_POINTS = 200


@dataclass(frozen=True)
class Curves:
    """For plots, each a list of pairs (x, y)."""

    roc: list[tuple[float, float]]
    """False positive rate, true positive rate."""
    precision_recall: list[tuple[float, float]]
    """Recall, precision."""
    reliability: list[tuple[float, float]]
    """Mean probability, share of slips; of the bins that are not empty."""


@dataclass(frozen=True)
class AlarmCurve:
    """Alarms over falling thresholds."""

    threshold: list[float]
    false_per_min: list[float]
    detection_rate: list[float]
    median_latency_s: list[float]
    """inf where most slips are missed."""


@dataclass(frozen=True)
class Evaluation:
    """One detector on one set of data."""

    model: str
    """Folder of the model."""
    network: str
    parameters: int
    settings: dict[str, Any]
    """Settings of its training, the seed included."""
    data: str
    scores: Metrics
    curves: Curves
    own: Alarms | None
    """At the model's own threshold. None where windows do not follow one another in time."""
    allowed: Alarms | None
    """At the lowest threshold that gives at most one false alarm a minute of holding."""
    alarm_curve: AlarmCurve | None
    groupings: list[Grouping]
    cost: Cost
    hop_s: float
    """Time between two predictions, to which latencies are exact."""
    align: Align | None
    """How the crop lies on sensors of another size than it was trained on; None: there may be none."""
    notes: list[str]
    """Remarks for the reader, such as what could not be measured."""
    rotation_speed: SpeedScores | None = None
    """Scores of the estimated speed in deg/s, of every prediction; None where there is no estimate."""
    slide_speed: SpeedScores | None = None
    """Scores of that in mm/s."""
    trained_on: str = ""
    """Identity of its training windows; "" in files from before it was kept."""


def evaluate_model(
    model: str | Path,
    data: EvaluationData,
    *,
    hop_s: float = HOP_S,
    resamples: int = bootstrap.RESAMPLES,
    align: Align | None = None,
    labelled_as: WindowSettings | None = None,
    progress: Callable[[int], None] | None = None,
) -> Evaluation:
    """Examine a saved detector. `progress` is called with how many more records, or windows, are done with. Raises
    DataError, ConfigError; DataError for another sensor than it was trained on, too, unless `align` says how the crop
    lies on that one. The windows of records are labelled as its training windows, or as those of `labelled_as`."""
    if not 0.001 <= hop_s <= 10 or resamples < 0:
        raise ConfigError(f"hop_s {hop_s:g}, resamples {resamples}: expected 0.001 to 10, and 0 or more")
    network, description = load_model(model)
    if data.windows is not None:
        check_windows(data.windows, description.windows, align)
        found, settings = predictions.on_windows(network, data.windows, progress), data.windows.settings
    else:
        settings = replace(description.windows, **(labelled_as or description.windows).labelling)
        hop_s = min(hop_s, in_whole_ms(settings.length_s))
        found = predictions.on_records(network, settings, _counted(data, progress), hop_s, align)
    clear = found.take(found.counted & np.isin(found.label, (Label.HOLD, Label.SLIP)))
    answers = clear.label, clear.names, clear.start_us, clear.recent, clear.p_slip
    scores = measured(*answers, description.threshold, resamples, slip_share(description.training, description.windows))
    draws = bootstrap.draws(len(found.tracks), resamples)
    own = allowed = curve = None
    if found.hop_us and (found.label == Label.HOLD).any():
        swept = alarms.sweep(found)
        own, allowed = alarms.alarms_at(found, description.threshold), alarms.at_allowed_rate(swept)
        rows = [(at.threshold, at.false_per_min, at.detection_rate, alarms.quantile(at.latency_s, 0.5)) for at in swept]
        curve = AlarmCurve(*map(list, zip(*rows, strict=True)))
    return Evaluation(
        model=str(model),
        network=description.model,
        parameters=sum(parameter.numel() for parameter in network.parameters()),
        settings=dict(description.training.get("settings", {})),
        data=data.name,
        scores=scores,
        curves=_curves(clear),
        own=own,
        allowed=allowed,
        alarm_curve=curve,
        groupings=groupings(found, settings, description.threshold, draws),
        cost=measure_cost(network, data.some_windows(settings, align=align)),
        hop_s=found.hop_us / 1e6,
        align=align,
        notes=[*data.notes, *_notes(found, own, len(data), description)],
        rotation_speed=speed_scores(found.speeds[:, 0], SpeedEstimate(*found.estimates[:, :2].T)),
        slide_speed=speed_scores(found.speeds[:, 1], SpeedEstimate(*found.estimates[:, 2:].T)),
        trained_on=data_identity(description.training, description.windows),
    )


def evaluate(model: str | Path, windows: Windows, *, align: Align | None = None) -> Metrics:
    """Scores of a saved detector. Raises DataError when the windows are not what it was trained for; `align` lets those
    of another sensor pass."""
    network, description = load_model(model)
    check_windows(windows, description.windows, align)
    if not len(windows):
        raise DataError("there is no window to evaluate on")
    share = slip_share(description.training, description.windows)
    return measure(windows, probabilities(network, windows), description.threshold, share)


def check_windows(windows: Windows, trained: WindowSettings, align: Align | None) -> None:
    """Raise DataError unless the windows have the size and length of those that a detector was trained on, and are from
    a sensor of the same size, or `align` lets another one pass."""
    have, want = Geometry.of(windows.settings), Geometry.of(trained)
    if have != want:
        raise DataError(
            f"the windows are {have.width}x{have.height} pixels and {have.length_us / 1e6:g} s long, "
            f"the model takes {want.width}x{want.height} and {want.length_us / 1e6:g} s"
        )
    require_sensor(trained, windows.settings.sensor, align, "the windows")


def _counted(data: EvaluationData, progress: Callable[[int], None] | None) -> Iterator[Record]:
    for record in data:
        yield record
        if progress:
            progress(1)


def _curves(clear: Predictions) -> Curves:
    found = weighted.distribution(clear.label, clear.p_slip)
    slips, holds = (np.concatenate([[0.0], np.cumsum(side[::-1])]) for side in (found.slip, found.hold))
    recalled, precision = weighted.precision_recall(found)
    share, mean, weight = weighted.reliability(found)
    filled = weight > 0
    both = slips[-1] > 0 and holds[-1] > 0
    return Curves(
        roc=_thinned(holds / holds[-1], slips / slips[-1]) if both else [],
        precision_recall=_thinned(recalled, precision) if slips[-1] else [],
        reliability=_thinned(mean[filled], share[filled]),
    )


def _thinned(x: np.ndarray, y: np.ndarray) -> list[tuple[float, float]]:
    chosen = np.unique(np.linspace(0, len(x) - 1, min(CURVE_POINTS, len(x))).round().astype(int))
    return list(zip(x[chosen].tolist(), y[chosen].tolist(), strict=True))


def _notes(found: Predictions, own: Alarms | None, records: int, description: Description) -> list[str]:
    notes = []
    if not found.hop_us:
        notes.append("windows of a file do not follow one another: alarms, latency and speeds of the arm need records")
    elif own is None:
        notes.append("no object is held still, so there are no false alarms to count")
    elif own.holding_min < 3:
        notes.append(f"{60 * own.holding_min:.0f} s of holding: too little to tell 1 false alarm a minute from none")
    if found.hop_us and (without := records - len(found.tracks)) > 0:
        notes.append(f"{without} of {records} records have no ground truth or hold nothing: left out")
    known = {
        "events on the object": (found.object_events != UNKNOWN).any(),
        "phases": (found.conditions.phase != 255).any(),
        "speed of the arm": np.isfinite(found.conditions.arm_speed_m_s).any(),
        "light and shading": np.isfinite(found.conditions.light_ratio).any(),
    }
    if found.hop_us and (missing := [what for what, is_known in known.items() if not is_known]):
        notes.append(f"the records do not tell: {', '.join(missing)}")
    validated = {plain_name(name) for name in description.training.get("validation_trajectories", [])}
    if seen := validated & {plain_name(track.name) for track in found.tracks}:
        notes.append(
            f"{len(seen)} trajectories are called as some it was validated on; if they are the same, it is flattered"
        )
    if math.isnan(slip_share(description.training, description.windows)):
        notes.append("nobody knows what share of its training windows slips: no ECE at the true share of slips")
    if found.label[found.counted].size and not (found.label == Label.SLIP).any():
        notes.append("no window slips: scores that need both labels are left out")
    return notes
