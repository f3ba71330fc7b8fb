"""The verb that cuts records into labelled windows."""

from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from evslip.cli.options import HIDDEN, Split, given, options_of, require_paths
from evslip.utils.atomic import require_place
from evslip.utils.console import console
from evslip.utils.errors import ConfigError
from evslip.utils.files import require_not_read
from evslip.utils.progress import Step
from evslip.windows.settings import WindowSettings

CROP = ("left", "top", "width", "height", "sensor_width", "sensor_height")
WindowOptions = options_of(WindowSettings, dict.fromkeys(CROP, HIDDEN))


def windows(
    datasets_and_out: Annotated[Positional[tuple[Path, ...]], arg(metavar="DATASET... OUT")],
    *,
    settings: Annotated[WindowSettings, arg(constructor=WindowOptions)],
    split: Split | None = None,
    camera: str | None = None,
    whole_sensor: bool = False,
    visualize: Path | None = None,
    vt_snn: Path | None = None,
) -> None:
    """Cut data sets, or imported recordings, into labelled windows.

    Args:
        datasets_and_out: Folders of data sets, or of imported recordings, or single records; then the HDF5 file to
            write. Recordings have windows where a person's labels say slip or hold. Of several, windows carry the name
            of their folder, and all must be from sensors of one size.
        split: Only this split; default: all there is.
        camera: Of samples that two cameras saw: left, right, or all, whose windows are then windows of their own, with
            the sample's truth and name.
        whole_sensor: Cut the whole sensor out, instead of 200 x 250 pixels around its middle.
        visualize: Folder for a video and single pictures of every window, named by label and change of angle; 17 files
            and about 4 s a window.
        vt_snn: Folder in which to write the windows in VT-SNN's layout, too: prophesee_recordings/rotate_01_td.mat ...
    """
    from evslip.data.layout import require_not_own
    from evslip.data.recordings import open_samples
    from evslip.exchange.vt_snn import check_folder as check_vt_snn
    from evslip.exchange.vt_snn import export_windows
    from evslip.windows.cutting import windows_of
    from evslip.windows.mixture import Mixture
    from evslip.windows.window_set import require_replaceable

    settings = WindowSettings(**given(settings))
    enough = len(datasets_and_out) >= 2
    require_paths("windows", datasets_and_out, enough, "one or more data sets, then the file to write")
    *datasets, out = datasets_and_out
    require_place(out)
    require_not_read(out, *datasets)
    for path in datasets:
        require_not_own(out, path)
        for folder in (vt_snn, visualize):
            if folder is not None:
                require_not_own(folder, path, is_folder=True)
    require_replaceable(out)
    if vt_snn is not None:
        check_vt_snn(vt_snn)
    sets = [open_samples(path) if split is None else open_samples(path).split(split) for path in datasets]
    sets = [samples.seen_by(camera) for samples in sets]
    if visualize is not None and (len(sets) > 1 or not sets[0].splits):
        which = "several are given" if len(sets) > 1 else f"{datasets[0]} is none"
        raise ConfigError(f"visualize: expected one data set of simulated samples, whose frames can be drawn; {which}")
    if visualize is not None:
        from evslip.view.pictures.window_pictures import check_cameras, check_folder

        check_folder(visualize)
        check_cameras(sets[0])
    cut = windows_of(Mixture(sets), settings, whole_sensor)
    cut.save(out)
    console.print(f"{out}: {cut.summary()}")
    if vt_snn is not None:
        console.print(f"{vt_snn}: {export_windows(cut, vt_snn)} files")
    if visualize is not None:
        from evslip.view.pictures.window_pictures import write_windows

        with Step("windows", len(cut)) as advance:
            write_windows(visualize, cut, sets[0], advance)
