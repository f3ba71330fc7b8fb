"""A trained detector, copied to where the package ships it, with a card that says where it comes from."""

import shutil
from pathlib import Path
from string import Template

from plan import Plan
from readings import assessment, detected, latency, samples, training
from steps import read_json

from evslip.data.layout import CONFIG
from evslip.learn.evaluation.evaluation import Evaluation

TEMPLATE = Path(__file__).with_name("card_template.md")
SCORES = {"balanced_accuracy": "balanced accuracy", "auroc": "AUROC", "ece": "ECE", "brier": "Brier"}


def ship(plan: Plan) -> Path:
    """Copy the chosen model, write its card. Exits with one line if it was not trained and tested."""
    network, seed = chosen(plan)
    folder, found = plan.model("complex", network, seed), assessment(plan.evaluation("test", network, seed))
    if not (folder / "model.json").is_file() or found is None:
        raise SystemExit(f"ship: {network}-{seed} is not trained and tested; run the stages train and test first")
    target = plan.ship_to or plan.out / "default"
    target.mkdir(parents=True, exist_ok=True)
    for path in (folder / "model.json", folder / "model.safetensors", plan.data("complex") / CONFIG):
        shutil.copyfile(path, target / path.name)
    (target / "README.md").write_text(card(plan, folder, found), encoding="utf-8")
    return target


def chosen(plan: Plan) -> tuple[str, int]:
    """The named one, or the final of the greatest validation AUROC: the test set does not choose."""
    if plan.ship_model is not None:
        network, _, seed = plan.ship_model.rpartition("-")
        if not network or not seed.isdecimal():
            raise SystemExit(f"ship-model: {plan.ship_model!r} is wrong, expected NETWORK-SEED such as countnet-0")
        return network, int(seed)
    known = {
        (network, seed): found.auroc
        for network in plan.finals
        for seed in plan.seeds
        if (found := training(plan.model("complex", network, seed))) is not None
    }
    if not known:
        raise SystemExit("ship: none of the finals is trained; run the stage train first")
    return max(known, key=lambda which: known[which])


def card(plan: Plan, folder: Path, found: Evaluation) -> str:
    """The model's card, from what the product wrote of the model, its training and its test."""
    known, learned = read_json(folder / "model.json"), training(folder)
    assert learned is not None
    settings, made = known["training"]["settings"], samples(plan, "complex", "train")
    changed = f" (changed: {', '.join(plan.keys)})" if plan.keys else ""
    return Template(TEMPLATE.read_text(encoding="utf-8")).substitute(
        known["windows"],
        network=known["model"],
        parameters=f"{found.parameters:,}",
        evslip=known["evslip"],
        torch=known["training"]["torch"],
        seed=settings["seed"],
        samples=("" if made is None else f"{made.status()['done']} ") + f"samples{changed}",
        training_windows=learned.windows[0],
        validation_windows=learned.windows[1],
        validation_trajectories=learned.trajectories,
        settings=", ".join(f"{name} {value}" for name, value in settings.items() if value != ""),
        threshold=f"{known['threshold']:.3f}, chosen on the validation trajectories",
        test_windows=found.scores.windows,
        test_trajectories=found.scores.trajectories,
        measured="\n".join(f"| {title} | {text} |" for title, text in measured(found).items()),
    )


def measured(found: Evaluation) -> dict[str, str]:
    """Figures by title, with intervals where there are some."""
    lines = {}
    for name, title in SCORES.items():
        interval = found.scores.intervals.get(name)
        told = f" ({interval[0]:.4f} to {interval[1]:.4f})" if interval is not None else ""
        lines[title] = f"{getattr(found.scores, name):.4f}{told}"
    if found.allowed is not None:
        times = [latency(found, share) for share in (0.5, 0.95)]
        told = [f"{1000 * value:.0f} ms" if value < float("inf") else "not reached" for value in times]
        lines["slips detected at 1 false alarm a minute"] = f"{100 * detected(found):.1f} %"
        lines[f"latency, median and p95 (exact to {1000 * found.hop_s:g} ms)"] = ", ".join(told)
    return lines | {"a window on one core": f"{found.cost.median_ms:.1f} ms"}
