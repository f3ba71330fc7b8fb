"""The tables of the results: every cell is read from what the product wrote."""

import csv
import json
from collections.abc import Iterator, Sequence

import stages
from plan import Plan
from readings import MISSING, PAPER, percent, samples, spread, tested, training, validated
from steps import done_path, log_path, read_json, seconds_of
from worlds import FIXED, WORLDS

from evslip.learn.evaluation.evaluation import Evaluation


def table(head: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    """In Markdown."""
    return "\n".join(f"| {' | '.join(line)} |" for line in (head, ["---"] * len(head), *lines))


def data(plan: Plan) -> str:
    """The data sets beside the paper's."""
    head = ("", "samples", "of them slip, hold, rejected", "seconds a sample", "MB a sample", "million events a sample")
    made = stages.main_sets(plan)
    rows = [
        ("Simple Set", "simple", "train", made["simple"]),
        ("Complex Set, training", "complex", "train", made["complex"]),
        ("Complex Set, test", "complex", "test", made["complex-test"]),
    ]
    lines = []
    for title, name, split, step in rows:
        found, seconds = samples(plan, name, split), seconds_of(plan.out, step)
        if found is None:
            lines.append([title, *[MISSING] * 5])
            continue
        known = found.status()
        done = known["done"]
        each = "–" if seconds is None else f"{seconds / done:.1f}"
        counts = f"{known['slip']}, {known['hold']}, {known['rejected']}"
        size, events = f"{known['bytes'] / done / 1e6:.1f}", f"{known['events'] / done / 1e6:.2f}"
        lines.append([title, str(done), counts, each, size, events])
    paper = ["the paper's", "192; 1000; 200", "", "162, 8 at a time", "883; 87 without frames and videos", "about 1"]
    return table(head, [*lines, paper])


def windows(plan: Plan) -> str:
    """How many windows there are, beside the paper's."""
    head = ("windows", "training + validation", "test", "the paper's")
    lines = []
    sets = (("Simple Set", "simple", "918 + 230"), ("Complex Set", "complex", "11554 + 2888, test 2682"))
    for title, group, paper in sets:
        counts = sorted({found.windows for network in plan.networks for found in validated(plan, group, network)})
        told = "; ".join(f"{a} + {b}" for a, b in counts[:3]) + (" ..." if len(counts) > 3 else "")
        tests = [one.scores for network in plan.networks for one in tested(plan, "test", network)]
        shown = f"{tests[0].windows} of {tests[0].trajectories} trajectories" if tests else MISSING
        lines.append([title, told or MISSING, shown if group == "complex" else "–", paper])
    return table(head, lines)


def table2(plan: Plan) -> str:
    """The paper's Table 2 beside ours, of the networks that the paper has."""
    head = (
        "network",
        "Simple val, paper",
        "ours, paper's protocol",
        "ours, by trajectory",
        "Complex val, paper",
        "ours, paper's protocol",
        "ours, by trajectory",
        "Complex test, paper",
        "ours",
    )
    lines = []
    for network in (name for name in plan.networks if name in PAPER):
        quoted = [f"{value:g}" for value in PAPER[network]]
        ours = [
            percent(validation(plan, group, network))
            for group in ("simple-paper", "simple", "complex-paper", "complex")
        ]
        test = percent([one.scores.balanced_accuracy for one in tested(plan, "test", network)])
        lines.append([f"`{network}`", quoted[0], *ours[:2], quoted[1], *ours[2:], quoted[2], test])
    return table(head, lines) if lines else "None of the paper's networks was trained (`--networks`)."


def others(plan: Plan) -> str:
    """Validation of the networks that the paper does not have."""
    names = [name for name in plan.networks if name not in PAPER]
    lines = [
        [f"`{name}`", *(percent(validation(plan, group, name)) for group in ("simple", "complex"))] for name in names
    ]
    return table(("network", "Simple Set", "Complex Set"), lines) if lines else "No other network was trained."


def validation(plan: Plan, group: str, network: str) -> list[float]:
    """Validation accuracy of each seed."""
    return [found.accuracy for found in validated(plan, group, network)]


def worlds(plan: Plan) -> str:
    """Balanced accuracy of the finals in worlds that they were not trained on, %."""
    head = ("world", "windows, trajectories", *(f"`{name}`" for name in plan.finals))
    lines = []
    for title, found in _in_worlds(plan):
        first = next((each[0] for each in found if each), None)
        counts = MISSING if first is None else f"{first.scores.windows}, {first.scores.trajectories}"
        accuracies = [percent([one.scores.balanced_accuracy for one in each]) for each in found]
        lines.append([title, counts, *accuracies])
    return table(head, lines)


def worlds_auroc(plan: Plan) -> str:
    """AUROC of the finals in these worlds."""
    lines = [
        [title, *(spread([one.scores.auroc for one in each], 3) for each in found)] for title, found in _in_worlds(plan)
    ]
    return table(("world: AUROC", *(f"`{name}`" for name in plan.finals)), lines)


def _in_worlds(plan: Plan) -> Iterator[tuple[str, list[list[Evaluation]]]]:
    """Each world's title, and the evaluations of every seed of each final in it."""
    rows = {"the Complex test set itself": "test"} | {WORLDS[name].title: f"worlds/{name}" for name in plan.worlds}
    for title, test_set in rows.items():
        yield title, [tested(plan, test_set, network) for network in plan.finals]


def ablation(plan: Plan) -> str:
    """Training without a part of the randomisation, tested with all of it."""
    head = ("fixed in training", "samples", *(f"`{name}`: balanced accuracy, %; AUROC" for name in plan.ablated))
    rows = {"nothing": "nothing"} | {FIXED[name].title: name for name in plan.ablations}
    lines = []
    for title, name in rows.items():
        made = samples(plan, f"ablation/{name}", "train")
        cells = [_two_scores(tested(plan, f"ablation/{name}", network)) for network in plan.ablated]
        lines.append([title, MISSING if made is None else str(made.status()["done"]), *cells])
    return table(head, lines)


def _two_scores(found: Sequence[Evaluation]) -> str:
    if not found:
        return MISSING
    accuracy, area = ([getattr(one.scores, name) for one in found] for name in ("balanced_accuracy", "auroc"))
    return f"{percent(accuracy)}; {spread(area, 3)}"


SEARCHED = """Trainings with settings drawn at random (`{space}`), the best by its validation loss. Accuracy, % of
validation, by trajectory as in Table 2. The best run and its settings were chosen by the split of one seed; the next
column trains with them for every seed, each with a split of its own."""


def sweeps(plan: Plan) -> str:
    """What searching settings brings, beside the defaults."""
    if not plan.searched:
        return "No sweep was run (`--trials N`)."
    head = (
        "set, network",
        "runs",
        "best run",
        "its settings, all seeds",
        "defaults, all seeds",
        "paper",
        "the settings",
    )
    lines = []
    for place in plan.searched:
        known, (group, network) = stages.swept(plan, place), place.split("/")
        if known is None:
            lines.append([place, *[MISSING] * (len(head) - 1)])
            continue
        found, best = known
        first = training(found.folder / best.folder)
        ours = [percent(validation(plan, name, network)) for name in (f"{group}-tuned", group)]
        paper = f"{PAPER[network][group == 'complex']:g}" if network in PAPER else "–"
        drawn = ", ".join(f"{k} {v:.2g}" if isinstance(v, float) else f"{k} {v}" for k, v in best.settings.items())
        accuracy = percent([] if first is None else [first.accuracy])
        ended = sum(trial.state in ("complete", "pruned", "failed") for trial in found.trials)
        lines.append([place, str(ended), accuracy, *ours, paper, drawn])
    return f"{SEARCHED.format(space=plan.space)}\n\n{table(head, lines)}"


def real(plan: Plan) -> str:
    """What the finals say of real recordings."""
    if plan.real is None:
        return "No recordings were given (`--real FOLDER`)."
    titles = (f"`{name}`: share said slip; median p" for name in plan.finals)
    head = ("recording", "sensor", "s", "million events/s", *titles)
    lines = []
    for path, about, says in stages.real(plan):
        record = read_json(done_path(plan.out, about))
        if record is None or record["refused"]:
            lines.append([path.name, MISSING if record is None else record["refused"], *[""] * (len(head) - 2)])
            continue
        known = json.loads(log_path(plan.out, about).read_text())
        facts = [f"{known['size'][0]} x {known['size'][1]}", f"{known['seconds']:.2f}"]
        rate = f"{known['count'] / known['seconds'] / 1e6:.2f}" if known["seconds"] else "–"
        cells = []
        for step in says.values():
            record = read_json(done_path(plan.out, step))
            cells.append(MISSING if record is None else record["refused"] or _said(stages.result(step).read_text()))
        lines.append([path.name, *facts, rate, *cells])
    return table(head, lines)


def _said(text: str) -> str:
    rows = list(csv.DictReader(text.splitlines()))
    chances = sorted(float(row["p_slip"]) for row in rows)
    slips = sum(row["slip"] == "1" for row in rows)
    return f"{100 * slips / len(rows):.0f} % of {len(rows)} answers; {chances[len(rows) // 2]:.2f}"
