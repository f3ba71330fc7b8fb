"""Events as NumPy's structured arrays, the form in which tonic and dv-processing have them."""

from typing import Literal

import numpy as np

from evslip.utils.errors import ConfigError, DataError

Layout = Literal["tonic", "dv"]
LAYOUTS: dict[str, np.dtype] = {
    "tonic": np.dtype([("x", np.int16), ("y", np.int16), ("t", np.int64), ("p", np.bool_)]),
    "dv": np.dtype(
        {
            "names": ["timestamp", "x", "y", "polarity"],
            "formats": [np.int64, np.int16, np.int16, np.int8],
            "offsets": [0, 8, 10, 12],
            "itemsize": 16,
        }
    ),
}
"""Layouts: of tonic's data sets and transforms; of `numpy()` of dv-processing's EventStore."""
_NAMES = {
    "t_us": ("t", "t_us", "ts", "timestamp"),
    "x": ("x",),
    "y": ("y",),
    "p": ("p", "polarity", "pol", "on"),
}
"""Names of a column in other packages' arrays and tables, by its own."""
_MOST = np.iinfo(np.int16).max


def rows_of(t_us: np.ndarray, x: np.ndarray, y: np.ndarray, p: np.ndarray, layout: str) -> np.ndarray:
    """Columns as one structured array of shape (n,). Raises ConfigError for an unknown layout, DataError for pixels
    beyond the layout's int16."""
    if layout not in LAYOUTS:
        raise ConfigError(f"layout: {layout!r} is unknown; expected one of {', '.join(LAYOUTS)}")
    rows = np.empty(len(t_us), LAYOUTS[layout])
    for name, own in _found(rows.dtype).items():
        column = {"t_us": t_us, "x": x, "y": y, "p": p}[own]
        if own in "xy" and column.max(initial=0) > _MOST:
            raise DataError(
                f"events/{own}: {column.max()} is out of range, expected at most {_MOST} in a {layout} array"
            )
        rows[name] = column
    return rows


def columns_of(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Times, columns, rows and polarities of a structured array, in the dtypes of Events. Raises DataError."""
    if not isinstance(rows, np.ndarray):
        raise DataError(f"{type(rows).__name__}: expected a structured NumPy array")
    found = {own: name for name, own in _found(rows.dtype).items()} if rows.ndim == 1 else {}
    lacking = [own for own in _NAMES if own not in found]
    if lacking:
        names = ", ".join(rows.dtype.names or ()) or "none"
        raise DataError(
            f"array of shape {rows.shape} with the fields {names}: lacks {', '.join(lacking)}; expected shape (n,), "
            "t (or timestamp) in microseconds, x, y and p (or polarity)"
        )
    t_us, x, y, p = (rows[found[own]] for own in _NAMES)
    for name, column in zip(_NAMES, (t_us, x, y), strict=False):
        if column.dtype.kind not in "iu":
            raise DataError(f"events/{name}: {column.dtype}; expected whole numbers, times in microseconds")
    for name, column, low, high in (("t_us", t_us, -(2**63), 2**63 - 1), ("x", x, 0, 65535), ("y", y, 0, 65535)):
        if len(column) and (column.min() < low or column.max() > high):
            raise DataError(f"events/{name}: {column.min()} to {column.max()}; expected {low} to {high}")
    if p.dtype.kind not in "biuf" or np.isnan(p).any():
        raise DataError(f"events/p: {p.dtype}, not always a number; expected numbers, above 0 for ON")
    return t_us.astype(np.int64), x.astype(np.uint16), y.astype(np.uint16), p > 0


def own_name(name: str) -> str | None:
    """Column of Events that a name of another package means; None if none."""
    return next((own for own, names in _NAMES.items() if name in names), None)


def _found(dtype: np.dtype) -> dict[str, str]:
    """Own name of each field of a dtype that is known."""
    known = ((name, own_name(name)) for name in dtype.names or ())
    return {name: own for name, own in known if own}
