"""Numbers for people: the unit that a key's name ends with, and lengths and masses in sizes of everyday life."""

UNITS = {
    "_kg_m3": "kg/m3", "_cd_m2": "cd/m2", "_per_s": "1/s", "_deg_s": "deg/s", "_m_s": "m/s",
    "_kg": "kg", "_deg": "deg", "_hz": "Hz", "_us": "us",
    "_px": "px", "_m": "m", "_n": "N", "_s": "s",
}  # fmt: skip
"""Ending of a name -> unit, longer endings first."""
SMALL = {"m": ("mm", 1e3), "kg": ("g", 1e3)}


def unit_of(name: str) -> str:
    """The unit of a key, or "" for a pure number or a name."""
    return next((unit for ending, unit in UNITS.items() if name.endswith(ending)), "")


def tell(name: str, value: object, digits: int = 4) -> str:
    """A value with its unit; below 1, metres become millimetres and kilograms grams."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value)
    unit, factor = unit_of(name), 1.0
    if unit in SMALL and value != 0 and abs(value) < 1:
        unit, factor = SMALL[unit]
    return f"{value * factor:,.{digits}g}".replace("e+0", "e") + (f" {unit}" if unit else "")
