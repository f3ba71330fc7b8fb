"""The table of a published data set: a row a sample."""

import hashlib
import json
from typing import Any

from evslip.data import record_file
from evslip.data.samples import Listing
from evslip.utils.errors import DataError

COLUMNS = {
    "file": ("sc:Text", "where the record is: an HDF5 file, or its name within a shard"),
    "name": ("sc:Text", "name of the sample"),
    "label": ("sc:Text", "slip, if the object slips at any time, hold, or unlabelled"),
    "onset_s": ("sc:Float", "when the first slip begins, in seconds of the sample's time; absent where there is none"),
    "seconds": ("sc:Float", "from the first event to the last"),
    "events": ("sc:Integer", "number of events, of all cameras"),
    "width": ("sc:Integer", "columns of the sensor"),
    "height": ("sc:Integer", "rows of the sensor"),
    "bytes": ("sc:Integer", "size of the record"),
    "sha256": ("sc:Text", "of the record"),
    "mass_kg": ("sc:Float", "mass of the object; absent for recordings"),
    "grip_force_n": ("sc:Float", "force of the grip; absent for recordings"),
    "friction": ("sc:Float", "friction of pads and object; absent for recordings"),
    "params": ("sc:Text", "all parameters as JSON; empty for recordings"),
    "notes": ("sc:Text", "what is noted of a recording as JSON"),
}
"""Type, after schema.org, and meaning of each column."""


def row(item: Listing, file: str) -> tuple[dict[str, Any], bytes]:
    """The table's row of a sample, and the bytes of its record. Raises DataError for a damaged one."""
    data = item.path.read_bytes()
    digest = hashlib.sha256(data).hexdigest()
    if item.sha256 is not None and digest != item.sha256:
        raise DataError(f"{item.path}: damaged, its sha256 is not the one it was written with; see `evslip verify`")
    sample = record_file.read(item.path, events=False)
    times = [one.events.t_us for one in record_file.views(item.path, record_file.ALL_CAMERAS)]
    params, notes = sample.params, json.dumps(sample.notes, sort_keys=True)
    onset_s = None if sample.onset_us is None else sample.onset_us / 1e6
    seconds = max((int(t_us[-1]) - int(t_us[0])) / 1e6 if len(t_us) else 0.0 for t_us in times)
    drawn = (None, None, None, "")
    if params is not None:
        drawn = params.object.mass_kg, params.grip.force_n, params.grip.friction, params.model_dump_json()
    stream = onset_s, seconds, sum(map(len, times)), *sample.size
    values = (file, sample.name, sample.label, *stream, len(data), digest, *drawn, notes)
    return dict(zip(COLUMNS, values, strict=True)), data


def json_line(values: dict[str, Any]) -> bytes:
    """A row of the table in JSON Lines."""
    return (json.dumps(values, ensure_ascii=False) + "\n").encode()
