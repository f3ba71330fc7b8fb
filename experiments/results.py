"""The pages of results: templates' texts, and tables of what has been measured."""

import json
import shlex
from collections.abc import Callable, Sequence
from pathlib import Path
from string import Template
from typing import Any

import goals
import machine
import stages
import tables
from plan import VARIANTS, Plan
from readings import MISSING, samples, tested

from evslip.config.loading import load_config
from evslip.data.dataset import Dataset

TEMPLATES = {"results.md": "results_template.md", "results-tables.md": "results_tables_template.md"}
TABLES: dict[str, Callable[[Plan], str]] = {
    "data": tables.data,
    "windows": tables.windows,
    "table2": tables.table2,
    "others": tables.others,
    "goals": goals.goals,
    "everything": goals.everything,
    "worlds": tables.worlds,
    "worlds_auroc": tables.worlds_auroc,
    "ablation": tables.ablation,
    "sweeps": tables.sweeps,
    "real": tables.real,
}
FULL = Plan(Path())
WHOLE = "This command ran all of it and wrote this page"
PARTLY = f"This command wrote this page before all of it was run; cells that say *{MISSING}* wait for it"
FIRST_SEEDS = "This command wrote this page before every seed was run; a cell without a range is of the first seed"


def write(plan: Plan, command: Sequence[str]) -> list[str]:
    """Write results.md and results-tables.md, which say that `command` made all of it, and results.png. Returns what is
    not there, a line each: tables with a gap, missing results."""
    parts = {name: make(plan) for name, make in TABLES.items()}
    holes = [f"the table of {name}" for name, text in parts.items() if MISSING in text]
    absent = [step.name for step in stages.results(plan) if not stages.result(step).exists()]
    words = dict(
        parts,
        verdict=goals.verdict(plan),
        size=size(plan),
        command=shlex.join(command),
        ran=PARTLY if holes else FIRST_SEEDS if absent else WHOLE,
        machines="\n".join(f"* {line}" for line in machine.describe(machines(plan))),
        seeds=", ".join(map(str, plan.seeds)),
        hop_ms=f"{1000 * plan.hop_s:g}",
        finals=", ".join(f"`{name}`" for name in plan.finals),
        training=training_options(plan),
        window_hop_s=f"{plan.window_hop_s:g}",
        picture=picture(plan),
    )
    for page, template in TEMPLATES.items():
        text = Template(Path(__file__).with_name(template).read_text(encoding="utf-8"))
        (plan.out / page).write_text(text.substitute(words), encoding="utf-8")
    return [*holes, *([f"{len(absent)} results, such as `{absent[0]}`"] if absent else [])]


def size(plan: Plan) -> str:
    """What was run, and by how much it is smaller than the paper's."""
    sets = (
        ("Simple Set", "simple", "train", FULL.simple),
        ("Complex Set, training", "complex", "train", FULL.complex_train),
        ("Complex Set, test", "complex", "test", FULL.complex_test),
    )
    made = {title: samples(plan, name, split) for title, name, split, _ in sets}
    counts = {title: 0 if found is None else found.status()["done"] for title, found in made.items()}
    told = f"{'; '.join(f'{title}: {count}' for title, count in counts.items())} samples"
    smaller = [f"{title} {counts[title]} of {full}" for title, _, _, full in sets if counts[title] < full]
    changed = dict.fromkeys(
        key for title, name, _, _ in sets if (found := made[title]) is not None for key in changed_keys(found, name)
    )
    if not smaller and not changed:
        return f"{told}: as many as the paper's."
    parts = [f"**This run is smaller than the paper's experiment**: {', '.join(smaller)} samples."] if smaller else []
    if changed:
        parts.append(f"**Its samples differ from the presets'** in {', '.join(f'`{key}`' for key in changed)}.")
    return f"{told}. {' '.join(parts)} Its figures are not those of the whole experiment."


def changed_keys(found: Dataset, preset: str) -> list[str]:
    """Keys in which a data set's configuration differs from a preset, with their values."""
    here, there = (leaves(config.model_dump(mode="json")) for config in (found.config, load_config(preset)))
    return [f"{key} = {value}" for key, value in here.items() if value != there[key]]


def leaves(tree: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Values by dotted key; a distribution is a value."""
    found: dict[str, Any] = {}
    for key, value in tree.items():
        nested = isinstance(value, dict) and "min" not in value
        found |= leaves(value, f"{prefix}{key}.") if nested else {prefix + key: value}
    return found


def training_options(plan: Plan) -> str:
    """What `evslip train` was told beyond the network and the seed."""
    ways = {name: VARIANTS[name] for name in plan.networks if name in VARIANTS}
    own = [f"`{name}` is `{kind}` with `{' '.join(way)}`" for name, (kind, way) in ways.items()]
    told = f"`{'`, `'.join(plan.training)}`" if plan.training else "the defaults of each network"
    return "; ".join([told, *own])


def note_machine(plan: Plan) -> None:
    """Remember what this run is on; once, however often it is resumed there."""
    known, here = machines(plan), machine.facts()
    if not any({**one, "date": None} == {**here, "date": None} for one in known):
        (plan.out / "machines.json").write_text(json.dumps([*known, here], indent=1) + "\n")


def machines(plan: Plan) -> list[dict]:
    """All that the experiment has run on."""
    path = plan.out / "machines.json"
    return json.loads(path.read_text()) if path.exists() else []


def picture(plan: Plan) -> str:
    """Curves of the finals' first seeds on the test set, as results.png; a line that shows it."""
    from evslip.view.evaluation.plots import write_scores_png

    firsts = {name: found[0] for name in plan.finals if (found := tested(plan, "test", name))}
    if not firsts:
        return MISSING
    write_scores_png(plan.out / "results.png", list(firsts.values()), list(firsts))
    return "![ROC, precision and recall, calibration, alarms of the finals, first seed](results.png)"
