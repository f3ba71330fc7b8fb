"""The part of a pad that presses on an object's side, and how hard where."""

from typing import NamedTuple

import numpy as np
from scipy import ndimage

from evslip.scene.shapes.shape import Shape
from evslip.utils.errors import PlanRejected

PAD_HALF_M = 0.0085
"""Half side of the Panda's square finger pad. The least grip.depth_m follows from it: config.sections.grip."""
PAD_STIFFNESS_PA_M = 1e9
"""Pressure by depth of indentation. An assumption: 2 mm of silicone rubber of Young's modulus 2 MPa."""
ELEMENTS = 12
"""Elements along a side of a flat patch for sums over it: Gauss points, they give an onset within 0.2 %."""
CONTACTS = np.array([(longer, shorter) for longer in (-0.7, 0.0, 0.7) for shorter in (-0.565, 0.565)])
"""Points that share the force equally, as shares of a rectangle's longer and shorter half side. For every direction of
slip and sides up to 8 : 1 their limit surface is within 0.96-1.04 of that of even pressure over the rectangle."""
WIDE_HALF_M = 0.010
"""From this half side on a pad bears so much torque that six points would begin to slip up to 4 % early, ..."""
WIDE_CONTACTS = np.array([(longer, shorter) for longer in (-0.78, -0.28, 0.28, 0.78) for shorter in (-0.54, 0.54)])
"""... so eight stand for its patch: the onset under gravity is then within 2 % of that of even pressure."""
CELL_M = 0.0005
"""Distance of the lines of sight along each side of the pad: they find the patch, ..."""
FINE_CELLS = 24
"""... and these along each side of its bounding rectangle give, in two steps, its pressure."""
SIDE_CELLS = 64
"""Lines of sight along each side of the object: they find where it is flat."""
FLAT_M = 0.001
"""Depth up to which what stands back belongs to the flat side that the pad slides on."""
LEAST_M = 0.0005
"""Smallest side of a patch on a flat side."""


class Pad(NamedTuple):
    """A flat square pad with a thin compliant layer."""

    half_m: float = PAD_HALF_M
    """Half its side."""
    stiffness_pa_m: float = PAD_STIFFNESS_PA_M
    """Pressure by depth of indentation."""

    @property
    def contacts(self) -> np.ndarray:
        """Points that share its force equally, as shares of the longer and shorter half side of what it touches, of
        shape (k, 2)."""
        return WIDE_CONTACTS if self.half_m >= WIDE_HALF_M else CONTACTS


PANDA_PAD = Pad()


class Patch(NamedTuple):
    """One pad on the object. Coordinates (x, z): along the width and up."""

    points: np.ndarray
    """Elements of the patch about the tool centre in metres, of shape (n, 2)."""
    weights: np.ndarray
    """Share of the pad's normal force that each element carries, of shape (n,)."""
    contacts: np.ndarray
    """Points with equal forces that stand for the patch in the physics, about the tool centre; of shape (k, 2)."""
    corners: np.ndarray
    """Two opposite corners of the patch's bounding rectangle, about the tool centre; of shape (2, 2)."""
    face_m: float
    """Distance of the touched face from the object's centre, along its depth."""
    slab: np.ndarray | None = None
    """Two opposite corners, from the object's centre, of the flat piece that the pad slides on; of shape (2, 2). None:
    the object's own side."""


def flat_patch(
    shape: Shape, side: int, point: tuple[float, float], force_n: float, friction: float, pad: Pad = PANDA_PAD
) -> Patch:
    """On a flat side as large as the bounding box's the pressure is even over the overlap.

    `point` is the tool centre (x, z) from the object's centre. Raises PlanRejected where the pad misses the object.
    """
    half = shape.half_m[[0, 2]]
    low, high = np.maximum(-pad.half_m, -half - point), np.minimum(pad.half_m, half - point)
    if (high - low < LEAST_M).any():
        raise _missed(shape, point)
    node, weight = np.polynomial.legendre.leggauss(ELEMENTS)
    centre, extent = (low + high) / 2, (high - low) / 2
    x, z = np.meshgrid(centre[0] + extent[0] * node, centre[1] + extent[1] * node)
    shares = pad.contacts if extent[0] >= extent[1] else pad.contacts[:, ::-1]
    return Patch(
        points=np.stack([x.ravel(), z.ravel()], axis=1),
        weights=np.outer(weight, weight).ravel() / 4,
        contacts=centre + extent * shares,
        corners=np.stack([low, high]),
        face_m=float(shape.half_m[1]),
    )


def pressed_patch(
    shape: Shape, side: int, point: tuple[float, float], force_n: float, friction: float, pad: Pad = PANDA_PAD
) -> Patch:
    """Patch that a flat pad with a thin compliant layer touches when pressed, unturned, on any shape with force_n.

    The layer is an elastic foundation: its pressure is proportional to its depth of indentation (Johnson, Contact
    Mechanics, 1985, section 4.3). Arguments as of flat_patch. Raises PlanRejected where the pad misses the object, or
    where its edge alone touches a slope that is too steep for the friction.
    """
    cells = round(2 * pad.half_m / CELL_M)
    cell = 2 * pad.half_m / cells
    steps = (np.arange(cells + 2) - (cells + 1) / 2) * cell  # with a rim one cell wide around the pad
    wide = shape.heights(side, point[0] + steps, point[1] + steps)
    heights, steps = wide[1:-1, 1:-1], steps[1:-1]
    if np.isinf(heights).all():
        raise _missed(shape, point)
    pressure = _indent(heights, force_n / cell**2, pad)
    if pressure[_rising(wide, friction * cell)].sum() > 0.5 * pressure.sum():
        raise PlanRejected(
            "grip",
            f"grip.offset, grip.depth_m: the edge of a pad would press on a slope of more than "
            f"{np.degrees(np.arctan(friction)):.0f} deg, too steep for grip.friction {friction:g}; grip nearer to "
            "where the object is thickest",
        )
    middles, low, high = np.stack([steps, steps], axis=1), np.full(2, -pad.half_m), np.full(2, pad.half_m)
    for _ in range(2):
        low, high = _around(pressure, low, high)
        middles = low + (high - low) * ((np.arange(FINE_CELLS) + 0.5) / FINE_CELLS)[:, None]
        heights = shape.heights(side, point[0] + middles[:, 0], point[1] + middles[:, 1])
        pressure = _indent(heights, force_n / float(np.prod((high - low) / FINE_CELLS)), pad)
    touched = pressure > 0
    x, z = np.meshgrid(middles[:, 0], middles[:, 1], indexing="ij")
    points, weights = np.stack([x[touched], z[touched]], axis=1), pressure[touched] / pressure.sum()
    margin = (high - low) / (2 * FINE_CELLS)
    corners = np.stack([points.min(axis=0) - margin, points.max(axis=0) + margin])
    top = float(heights.max())
    return Patch(
        points, weights, _fitted(points, weights, pad.contacts), corners, top, _slab(shape, side, top, corners + point)
    )


def _around(pressure: np.ndarray, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners (2,) of the rectangle around the cells that touch, one cell wider, within the cells' (low, high)."""
    cell = (high - low) / pressure.shape
    used = [np.flatnonzero(pressure.any(axis=axis)) for axis in (1, 0)]
    first, last = (np.array([rows[k] for rows in used]) for k in (0, -1))
    return np.maximum(low, low + (first - 1) * cell), np.minimum(high, low + (last + 2) * cell)


def _indent(heights: np.ndarray, force_per_area: float, pad: Pad) -> np.ndarray:
    """Pressure (relative) of a foundation on heights (p, q), such that it sums up to a force divided by a cell's area.

    The deepest n cells touch at the depth that carries the force, for the one n that fits.
    """
    gaps = np.sort((heights.max() - heights).ravel())
    gaps = gaps[np.isfinite(gaps)]
    depths = (force_per_area / pad.stiffness_pa_m + np.cumsum(gaps)) / np.arange(1, len(gaps) + 1)
    depth = depths[np.flatnonzero(depths > gaps)[-1]]
    return np.maximum(0.0, depth - (heights.max() - heights))


def _rising(wide: np.ndarray, rise_m: float) -> np.ndarray:
    """Cells of the pad's border beyond which the object rises by more than `rise_m` to the next cell: `wide` (p, q)
    holds heights of the pad and a rim; bool of shape (p - 2, q - 2)."""
    pad = np.s_[1:-1]
    rising = np.zeros((wide.shape[0] - 2, wide.shape[1] - 2), bool)
    with np.errstate(invalid="ignore"):  # where the object is neither under the border nor beyond it
        rising[0] |= wide[0, pad] - wide[1, pad] > rise_m
        rising[-1] |= wide[-1, pad] - wide[-2, pad] > rise_m
        rising[:, 0] |= wide[pad, 0] - wide[pad, 1] > rise_m
        rising[:, -1] |= wide[pad, -1] - wide[pad, -2] > rise_m
    return rising


def _fitted(points: np.ndarray, weights: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Points with equal forces that have the centre, the principal axes and the torsional friction of a patch."""
    centre = weights @ points
    arms = points - centre
    variances, axes = np.linalg.eigh((arms.T * weights) @ arms)
    contacts = shares[:, ::-1] * np.sqrt(np.maximum(variances, 0.0))
    contacts *= weights @ np.linalg.norm(arms, axis=1) / np.linalg.norm(contacts, axis=1).mean()
    return centre + contacts @ axes.T


def _slab(shape: Shape, side: int, top_m: float, touched: np.ndarray) -> np.ndarray:
    """Corners (2, 2) of a rectangle around the flat region of a side of which the touched one is a part."""
    half = shape.half_m[[0, 2]]
    cell = 2 * half / SIDE_CELLS
    x, z = ((np.arange(SIDE_CELLS) - (SIDE_CELLS - 1) / 2) * size for size in cell)
    regions = np.empty((SIDE_CELLS, SIDE_CELLS), np.int32)
    ndimage.label(shape.heights(side, x, z) > top_m - FLAT_M, output=regions)
    first, last = np.clip(((touched + half) / cell).astype(int), 0, SIDE_CELLS - 1)
    under = regions[first[0] : last[0] + 1, first[1] : last[1] + 1]
    columns, rows = np.nonzero(np.isin(regions, under[under > 0]))
    low = np.array([places.min(initial=SIDE_CELLS) for places in (columns, rows)]) * cell - half
    high = np.array([places.max(initial=-1) + 1 for places in (columns, rows)]) * cell - half
    return np.clip([np.minimum(low, touched[0]), np.maximum(high, touched[1])], -half, half)


def _missed(shape: Shape, point: tuple[float, float]) -> PlanRejected:
    x, z = (1e3 * value for value in point)
    width, _, height = 1e3 * shape.half_m
    return PlanRejected(
        "grip",
        f"grip.offset, grip.depth_m, grip.error_x_m: the pads miss the object: the tool centre is ({x:.1f}, {z:.1f}) "
        f"mm along width and height from its middle, and it reaches to +-({width:.1f}, {height:.1f}) mm there",
    )
