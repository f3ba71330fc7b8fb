"""Events as NumPy arrays: t_us, x, y, p, size, the labels body and cause if there are any, and perhaps settings."""

import io
import zipfile
from pathlib import Path

import numpy as np

from evslip.codecs.source import Source
from evslip.events.checks import check_events, check_size
from evslip.events.stream import Events
from evslip.utils import atomic
from evslip.utils.errors import DataError
from evslip.utils.files import MOST_COMPRESSED, require_file


def stream(path: Path) -> Source:
    """The events, read all at once, and the sensor's (width, height). Raises DataError."""
    require_file(path)
    try:
        with zipfile.ZipFile(path) as archive:
            claimed = sum(item.file_size for item in archive.infolist())
        if claimed > MOST_COMPRESSED * path.stat().st_size:
            raise DataError(f"{path}: claims {claimed} bytes, more than can be packed into it")
        with np.load(path, allow_pickle=False) as arrays:
            lacking = [name for name in (*Events._fields[:4], "size") if name not in arrays]
            if lacking:
                raise DataError(f"{path}: lacks {', '.join(lacking)}; expected the arrays t_us, x, y, p and size")
            columns = [arrays.get(name) for name in Events._fields]
            width, height = (int(side) for side in arrays["size"])
    except DataError:
        raise
    except Exception as error:  # zipfile, zlib and NumPy's header parser each have their own
        raise DataError(f"{path}: not an .npz file of events: {' '.join(str(error).split())[:160]}") from None
    known = [isinstance(column, np.ndarray) for column in columns]
    if not all(known[:4]):
        raise DataError(f"{path}: expected the arrays t_us, x, y, p and size")
    events = Events._make(column if is_array else None for column, is_array in zip(columns, known, strict=True))
    size = check_size(width, height, path)
    check_events(events, size, path)
    return Source(size, iter([events]))


def write(path: Path, events: Events, size: tuple[int, int], settings: str | None = None) -> None:
    """Write atomically; `settings`: JSON text for the array of that name. Raises StorageError."""
    check_events(events, size, path)
    buffer = io.BytesIO()
    arrays = {name: column for name, column in events._asdict().items() if column is not None}
    if settings is not None:
        arrays["settings"] = np.array(settings)
    np.savez_compressed(buffer, size=np.array(size), **arrays)
    atomic.write_bytes(path, buffer.getvalue())
