"""Faces of a box that are turned to points, and its edges between a face that is and one that is not.

A face is a bit of a number: bit 2 a + side for the face across axis a, with side 0 below and 1 above.
"""

from evslip.rendering.geometry.simd_minmax import larger, smaller
from evslip.rendering.scratch import clamped, kernel, slot
from evslip.rendering.slots import SLOT


@kernel
def faces_seen(S, n, at, half, rim):
    """Faces that no point sees, and those that all see. at: slots of the points' coordinates in the box's frame, one
    after the other; half: its half sides; rim: how far behind a face's plane a point begins to see it."""
    n, never, always = clamped(n), 0, 0
    for a in range(3):
        axis = slot(at + a * SLOT)
        low, high = S[axis], S[axis]
        for i in range(n):
            low, high = smaller(low, S[axis + i]), larger(high, S[axis + i])
        never |= (0 if low < rim - half[a] else 1 << (2 * a)) | (0 if high > half[a] - rim else 2 << (2 * a))
        always |= (1 << (2 * a) if high < -half[a] else 0) | (2 << (2 * a) if low > half[a] else 0)
    return never, always


@kernel
def matters(never, always, face, other):
    """Whether any point sees just one of the two faces that meet at an edge."""
    both = face | other
    return (never & both) != both and (always & both) != both
