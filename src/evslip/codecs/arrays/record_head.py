"""Head of a record's file: of a version and a kind that this evslip reads, whoever asks for its events."""

from typing import Literal, get_args

import h5py

from evslip.utils import hdf5
from evslip.utils.errors import DataError

FORMAT, VERSION, VERSION_OF_SEVERAL = "evslip", 1, 2
"""Records of several cameras have a version of their own: who knows only the first takes them for no stream at all."""
CAMERAS = "cameras"
"""Group of a record of several cameras: in it is a group of each, in the layout of DSEC."""
Kind = Literal["simulated", "rejected", "recording"]


def is_record(file: h5py.File) -> bool:
    """Whether a file is a record of evslip. Raises DataError for one of another version, or of no known kind."""
    if str(file.attrs.get("format")) != FORMAT:
        return False
    version, kind = hdf5.attribute(file, "version", int), hdf5.attribute(file, "kind", str)
    if version != (VERSION_OF_SEVERAL if CAMERAS in file else VERSION):
        known = f"version {VERSION}, and {VERSION_OF_SEVERAL} with a group {CAMERAS}"
        raise DataError(f"{file.filename}: version {version} of the format; this evslip reads {known}")
    if kind not in get_args(Kind):
        raise DataError(f"{file.filename}: kind {kind[:60]!r} is unknown; expected one of {', '.join(get_args(Kind))}")
    return True


def cameras_of(file: h5py.File) -> tuple[str, ...]:
    """Names of the cameras of a record of several; none of any other file."""
    return tuple(sorted(hdf5.group(file, CAMERAS))) if CAMERAS in file else ()


def stream_of(file: h5py.File, camera: str | None) -> h5py.Group:
    """The group that holds the events of a file, those of a camera where it has several. Raises DataError where one of
    several has to be chosen, or one is asked for that is not there."""
    names = cameras_of(file)
    if camera is None and not names:
        return file
    if camera not in names:
        raise DataError(f"{file.filename}: {wrong_camera(names, camera)}")
    return hdf5.group(hdf5.group(file, CAMERAS), camera)


def wrong_camera(names: tuple[str, ...], camera: str | None) -> str:
    """Message of a wrong choice among these cameras: what is wrong, and what would be right."""
    if not names:
        return f"holds the events of one camera, which has no name; expected no camera, not {camera!r}"
    choice = f"expected one of them, such as --camera {names[0]}" + ("" if camera is None else f", not {camera!r}")
    if camera is None:  # asked perhaps by a command that takes no camera
        choice += f"; evslip convert FILE OUT --camera {names[0]} writes one of them to a file of its own"
    return f"holds the events of the cameras {', '.join(names)}; {choice}"
