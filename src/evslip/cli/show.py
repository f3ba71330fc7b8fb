"""The verb that shows: configurations, draws, cameras, textures."""

from json import dumps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from evslip.cli.options import PRESET, Overrides, Split, given, options_of, overrides
from evslip.events.biases import Biasing
from evslip.utils.console import console
from evslip.utils.errors import ConfigError, EvslipError

if TYPE_CHECKING:
    from evslip.config.config import Config

_SHOWN = (
    f'{PRESET}, a TOML file, "parameters" for a table of all keys, "camera" for the event cameras, "textures" for a '
    'contact sheet, "robot" for a robot from four sides and its limits, or a file of `evslip events` (.h5, .npz) or of '
    "`evslip generate` for the settings inside it."
)


def show(
    preset: Annotated[Positional[str], arg(help=_SHOWN)],
    name: Positional[str | None] = None,
    *,
    set: Overrides = (),
    index: int | None = None,
    split: Split = "train",
    json: bool = False,
    plot: Path | None = None,
    check_split: bool = False,
    masses: bool = False,
    count: int | None = None,
    test_count: int = 200,
    biasing: Annotated[Biasing, arg(constructor=options_of(Biasing))],
    out: Path | None = None,
) -> None:
    """Print a configuration in full, what it draws, a camera, or a file's settings; write a sheet of textures.

    Args:
        name: After "camera": preset of the event camera; default: a table of all. After "textures": a name, pattern or
            folder; default: the whole pool. After "robot": a name or file, as robot.kind; default: panda.
        set: Override, such as object.mass_kg=0.05; may be given several times.
        index: Show what is drawn for this sample instead, with its predicted onset of slip.
        split: Split of that sample.
        json: That sample as JSON.
        plot: Draw how every parameter is distributed into this PNG file.
        check_split: Draw all samples; exit code 2 if training and testing share a value.
        masses: Say which masses surely hold and surely slip in every sample.
        count: Samples of the training split for the last three; default: a whole grid, or 1000.
        test_count: Samples of the test split for them.
        out: File of the textures' contact sheet; default: textures.png. Of the robot; default: robot.png. After
            "camera": write a preset, OUT.toml, which every command takes.
    """
    from evslip.codecs.settings import keeps_settings, read_settings
    from evslip.config.loading import dump_config, load_config
    from evslip.config.reference import parameters_table

    if preset == "camera":
        return _camera(name, Biasing(**given(biasing)), out)
    if preset == "textures":
        return _textures(name, out or Path("textures.png"))
    if preset == "robot":
        return _robot(name or "panda", out or Path("robot.png"))
    if name is not None:
        raise ConfigError(f"show {preset}: {name!r} is one word too many; show camera, textures and robot take a name")
    if preset == "parameters":
        print(parameters_table(), end="")
        return None
    if keeps_settings(preset):
        print(dumps(read_settings(preset), indent=2))
        return None
    config = load_config(preset, overrides(set))
    if check_split:
        return _check_split(config, preset, count, test_count)
    if masses:
        return _masses(config, count)
    if plot is not None:
        return _plot(config, plot, count, test_count)
    if json and index is None:
        raise ConfigError("json: is of a sample; give its index, too")
    if index is None:
        print(dump_config(config), end="")
        return None
    return _draw(config, index, split, json)


def _camera(name: str | None, biasing: Biasing, out: Path | None) -> None:
    from dataclasses import replace

    from evslip.events import preset_file
    from evslip.events.biases import circuit, parse_biases, pixel_parameters
    from evslip.events.datasheet import bias_sheet, bias_table, datasheet, presets_table
    from evslip.events.presets import named, named_readout
    from evslip.utils import atomic

    model, readout = named(name or "davis346"), named_readout(name or "davis346")
    if biasing.biases:
        biases = parse_biases(biasing.biases)
        model = replace(model, **pixel_parameters(circuit(biases, biasing.white_lux), model))
        print(bias_sheet(biases, biasing.white_lux))
    elif biasing.biases is not None:
        print(bias_table(model, biasing.white_lux), end="")
        return
    elif name is None:
        print(presets_table(), end="")
        return
    print(f"{datasheet(model)}\nreadout\n{datasheet(readout)}", end="")
    if out is not None:
        if out.suffix.lower() != preset_file.SUFFIX or preset_file.maps_of(model):
            raise ConfigError(f"{out}: a preset without maps is written to a file such as OUT.toml")
        atomic.write_text(out, preset_file.text(model, {}, readout=readout))


def _textures(name: str | None, out: Path) -> None:
    from evslip.scene.textures import library
    from evslip.view.pictures.texture_sheet import write_sheet

    names = library.pool(True) if name is None else library.expand(name, is_background=True)
    names = names if isinstance(names, tuple) else (str(names),)
    write_sheet(out, names)
    console.print(f"{out}: {len(names)} textures")


def _robot(name: str, out: Path) -> None:
    from evslip.view.robot_sheet import write_robot_sheet

    print(write_robot_sheet(out, name), end="")
    console.print(f"{out}: the robot from four sides")


def _draw(config: "Config", index: int, split: str, json: bool) -> None:
    from evslip.draws.draw import draw
    from evslip.draws.draw_sheet import draw_sheet

    print(draw(config, index, split).model_dump_json(indent=2) if json else draw_sheet(config, index, split).rstrip())


def _counts(config: "Config", count: int | None, test_count: int) -> dict[str, int]:
    from evslip.draws.draw import grid_size

    if count is None:
        count = grid_size(config) if config.sampling == "grid" and grid_size(config) > 1 else 1000
    for name, number in (("count", count), ("test_count", test_count)):
        if number < 1:
            raise ConfigError(f"{name}: {number} is out of range, expected 1 or more")
    return {"train": count, "test": test_count} if config.test_share else {"train": count}


def _check_split(config: "Config", source: str, count: int | None, test_count: int) -> None:
    from evslip.draws.separation import separate, textures_of

    counts = _counts(config, count, test_count)
    if "test" not in counts:
        raise ConfigError("test_share: is 0, so the configuration has no test split to check")
    found = separate(config, counts)
    for line in found.report():
        console.print(line)
    pictures = textures_of(found)
    if pictures:
        console.print(f"textures: {pictures['train']} in train, {pictures['test']} in test")
    shared = found.shared()
    if shared:
        name, values = next(iter(shared.items()))
        raise EvslipError(
            f"{source}: {name}: {len(values)} values occur in both splits, such as {min(values, key=str)!r}"
        )
    console.print(f"{counts['train']} + {counts['test']} samples drawn: train and test share no value")


def _masses(config: "Config", count: int | None) -> None:
    from evslip.config.units import tell
    from evslip.draws.draw import sure_masses

    number = _counts(config, count, 1)["train"]
    low, high, hold, slip = (tell("_kg", mass) for mass in sure_masses(config, number))
    console.print(
        f"{number} samples: onset masses from {low} to {high}; {hold} holds in all of them, {slip} slips in all"
    )


def _plot(config: "Config", path: Path, count: int | None, test_count: int) -> None:
    from evslip.view.pictures.distributions import write_distributions

    counts = _counts(config, count, test_count)
    number = write_distributions(path, config, counts)
    console.print(f"{path}: {number} parameters of {' + '.join(map(str, counts.values()))} samples")
