"""The experiment's stages: which commands of evslip each of them is."""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path

from plan import PAPERS, VARIANTS, Plan
from steps import Step
from worlds import EVERYTHING, FIXED, MESH, WORLDS

from evslip.codecs.formats import recordings_in
from evslip.config.loading import dump_config, load_config, parse_override
from evslip.data.dataset import finished
from evslip.data.layout import CONFIG
from evslip.draws.draw_plan import pinned
from evslip.learn.checkpoint import read_description
from evslip.learn.search.sweep import JOURNAL, Sweep, Trial, read_sweep
from evslip.learn.training.settings import TrainSettings

SETS = {"simple": "simple", "complex": "complex", "simple-paper": "simple", "complex-paper": "complex"}
"""What detectors are trained on, and the data set that its windows come from."""


def generated(
    plan: Plan, name: str, count: int, split: str, keys: dict[str, str] | None = None, preset: str | None = None
) -> Step:
    """Fill a split of a data set; preset: by default that of the set's name."""
    changes = {key: value for key, _, value in (text.partition("=") for text in plan.keys)} | (keys or {})
    preset, folder = preset or ("simple" if name == "simple" else "complex"), plan.data(name)
    texts = [f"{key}={mesh_path(plan) if value == MESH else value}" for key, value in changes.items()]
    words = ["generate", preset, str(folder), "--count", str(count), "--split", split]
    return Step(
        name=f"generate {name} {split}",
        words=(*words, *(word for text in texts for word in ("--set", text))),
        aside=() if plan.workers is None else ("--workers", str(plan.workers)),
        is_done=partial(_has_samples, folder, preset, texts, split, count),
    )


def mesh_path(plan: Plan) -> Path:
    """The mesh of the world of that name."""
    return plan.out / "meshes" / "jar.stl"


def _has_samples(folder: Path, preset: str, texts: list[str], split: str, count: int) -> bool:
    path, wanted = folder / CONFIG, load_config(preset, dict(map(parse_override, texts)))
    if not path.is_file() or path.read_text(encoding="utf-8") != dump_config(pinned(wanted)):
        return False  # `evslip generate` says what differs
    return len(finished(folder, split, range(count))) == count


def main_sets(plan: Plan) -> dict[str, Step]:
    """The data of the paper's experiment."""
    return {
        "simple": generated(plan, "simple", plan.simple, "train"),
        "complex": generated(plan, "complex", plan.complex_train, "train"),
        "complex-test": generated(plan, "complex", plan.complex_test, "test"),
    }


def data(plan: Plan) -> tuple[list[Step], list[Step]]:
    """Generate the Simple and the Complex Set; check every byte."""
    made = main_sets(plan)
    return list(made.values()), [
        Step("verify simple", ("verify", str(plan.data("simple"))), needs=(made["simple"],)),
        Step("verify complex", ("verify", str(plan.data("complex"))), needs=(made["complex"], made["complex-test"])),
    ]


def result(step: Step) -> Path:
    """What a step that writes one file writes."""
    assert step.output is not None
    return step.output


def cut(plan: Plan, name: str, made: Step, folder: Path, *more: str) -> Step:
    """Cut a training split's windows."""
    path = plan.windows(name)
    words = ("windows", str(folder), str(path), "--split", "train", "--hop-s", f"{plan.window_hop_s:g}", *more)
    return Step(f"windows {name}", words, path, (made,))


def windows(plan: Plan) -> dict[str, Step]:
    """Windows of both sets: once as they should be, once with the labels of the paper's public code."""
    made = main_sets(plan)
    return {
        name: cut(plan, name, made[source], plan.data(source), *(["--labels", "paper"] if name != source else []))
        for name, source in SETS.items()
    }


def trained(plan: Plan, group: str, network: str, seed: int, cut_step: Step, *more: str) -> Step:
    """Train one network with one seed."""
    folder = plan.model(group, network, seed)
    kind, way = VARIANTS.get(network, (network, ()))
    words = ("train", str(result(cut_step)), str(folder), "--model", kind, "--seed", str(seed))
    options = (*way, *plan.options(network), *more)
    return Step(f"train {group}/{network}-{seed}", (*words, *options), folder / "model.json", (cut_step,))


def train(plan: Plan) -> list[Step]:
    """Every network and seed by trajectory; the paper's networks under its protocol, too."""
    files = windows(plan)
    steps = [
        trained(plan, group, network, seed, files[group])
        for group, network, seed in product(("simple", "complex"), plan.networks, plan.seeds)
    ]
    return steps + [
        trained(plan, group, network, seed, files[group], "--protocol", "paper")
        for group, network, seed in product(("simple-paper", "complex-paper"), plan.networks, plan.seeds)
        if network in PAPERS
    ]


def sweep(plan: Plan) -> list[Step]:
    """Search settings on the training windows."""
    files, steps = windows(plan), []
    for place in plan.searched:
        group, network = place.split("/")
        folder = plan.sweep(place)
        words = ("sweep", str(result(files[group])), str(folder), "--model", network, "--space", plan.space)
        more = ("--trials", str(plan.trials))
        is_done = partial(_has_trials, folder / "sweep.csv", plan.trials)
        steps.append(Step(f"sweep {place}", words, needs=(files[group],), aside=more, is_done=is_done))
    return steps


def _has_trials(path: Path, count: int) -> bool:
    return path.is_file() and len(path.read_text().splitlines()) > count


def swept(plan: Plan, place: str) -> tuple[Sweep, Trial] | None:
    """What the sweep of a set and network has found, and the best of it; None if there is none yet."""
    folder = plan.sweep(place)
    found = read_sweep(folder) if (folder / JOURNAL).is_file() else None
    return None if found is None or found.best is None else (found, found.best)


def tuned(plan: Plan) -> list[Step]:
    """The best settings of each sweep with every seed: how much of the find was luck."""
    files, steps = windows(plan), []
    for place in plan.searched:
        known = swept(plan, place)
        if known is None:
            continue
        (found, best), (group, network) = known, place.split("/")
        settings = TrainSettings(**read_description(found.folder / best.folder).training["settings"])
        for seed in plan.seeds:
            folder = plan.model(f"{group}-tuned", network, seed)
            words = ("train", str(result(files[group])), str(folder), *replace(settings, seed=seed).words())
            steps.append(Step(f"train {group}-tuned/{network}-{seed}", words, folder / "model.json", (files[group],)))
    return steps


def evaluated(plan: Plan, test_set: str, network: str, seed: int, model: Step, made: Step, folder: Path) -> Step:
    """Examine a detector on the test split of a data set."""
    out = plan.evaluation(test_set, network, seed)
    words = ("evaluate", str(result(model).parent), str(folder), "--split", "test", "--out", str(out))
    more = ("--hop-s", f"{plan.hop_s:g}", "--resamples", str(plan.resamples))
    return Step(f"evaluate {test_set}/{network}-{seed}", (*words, *more), out / "evaluation.json", (model, made))


def test(plan: Plan) -> list[Step]:
    """All detectors trained on the Complex Set, once, on its test set."""
    made, file = main_sets(plan)["complex-test"], windows(plan)["complex"]
    return [
        evaluated(
            plan, "test", network, seed, trained(plan, "complex", network, seed, file), made, plan.data("complex")
        )
        for network, seed in product(plan.networks, plan.seeds)
    ]


def worlds(plan: Plan) -> tuple[list[Step], list[Step]]:
    """Generate a small test set of each shifted world; try the finals in it."""
    file, makings, trials = windows(plan)["complex"], [], []
    for name in plan.worlds:
        count = plan.traced if name == "pathtraced" else plan.world
        made = generated(plan, f"worlds/{name}", count, "test", WORLDS[name].keys)
        makings.append(made)
        for network, seed in product(plan.finals, plan.seeds):
            model = trained(plan, "complex", network, seed, file)
            folder = plan.data(f"worlds/{name}")
            trials.append(evaluated(plan, f"worlds/{name}", network, seed, model, made, folder))
    return makings, trials


def ablation(plan: Plan) -> tuple[list[Step], list[Step], list[Step], list[Step]]:
    """Training sets with all of the randomisation, and without one part each, and one test set with all of it; their
    windows; trainings; trials."""
    held_out = generated(plan, "ablation/nothing", plan.ablation_test, "test", EVERYTHING)
    makings, cuts, trainings, trials = [held_out], [], [], []
    for name in ("nothing", *plan.ablations):
        keys = EVERYTHING | (FIXED[name].keys if name in FIXED else {})
        made = generated(plan, f"ablation/{name}", plan.ablation_train, "train", keys)
        file = cut(plan, f"ablation-{name}", made, plan.data(f"ablation/{name}"))
        makings.append(made)
        cuts.append(file)
        for network, seed in product(plan.ablated, plan.seeds):
            model = trained(plan, f"ablation-{name}", network, seed, file)
            trainings.append(model)
            folder = plan.data("ablation/nothing")
            trials.append(evaluated(plan, f"ablation/{name}", network, seed, model, held_out, folder))
    return makings, cuts, trainings, trials


def recordings(plan: Plan) -> list[Path]:
    """The real recordings: all that can be read as events in their folder."""
    return recordings_in(plan.real) if plan.real is not None else []


def real(plan: Plan) -> Iterator[tuple[Path, Step, dict[str, Step]]]:
    """For each recording: what it holds, and what the finals of the first seed say of it."""
    file, seed = windows(plan)["complex"], plan.seeds[0]
    for path in recordings(plan):
        about = Step(f"info {path.name}", ("info", str(path), "--json"), may_refuse=True)
        says = {}
        for network in plan.finals:
            model, stem = trained(plan, "complex", network, seed, file), plan.out / "real" / path.name / network
            words = ("detect", "--model", str(result(model).parent), str(path), "--out", str(stem), "--hop-s", "0.02")
            words += ("--align", "centre")
            says[network] = Step(
                f"detect {path.name}/{network}", words, stem.with_suffix(".csv"), (model,), may_refuse=True
            )
        yield path, about, says


def results(plan: Plan) -> list[Step]:
    """All steps that the tables are read from, but those of sweeps and real recordings."""
    (_, trials), (*_, ablated) = worlds(plan), ablation(plan)
    return [*train(plan), *test(plan), *tuned(plan), *trials, *ablated]
