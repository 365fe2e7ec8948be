"""Stage 3, narrow phase: how far a surface edge is from the triangles of a pair.

Bodies at rest on each other move by more than the gap between them in a step, but together. What
separated an edge from a triangle in the last detection pass then does so in this one: of the axes
along which they may be apart, it is tried first, and the others only where the gap along it is less
than half of the least gap of the pair before.
"""

import warp as wp

from warp_contact.kernels.broad_phase.edges import axis_of, gap_along, separation
from warp_contact.kernels.geometry import NONE
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

ALIKE = wp.constant(0.5)  # of the least gap of a pair: one above this need not be known better


@wp.struct
class Apart:
    """What separates the edges and the triangles of all pairs, since these were found."""

    gap: wp.array[float]  # (pairs,) [m] least one along the axes when they were found, 0 without
    axis: wp.array[wp.int8]  # (items,) of each triangle


@wp.func
def gap_along_kept(axis: int, t: wp.vec3i, x: wp.array[wp.vec3], p: wp.vec3, q: wp.vec3) -> float:
    """Gap [m] between pq and triangle t along one of their axes."""
    a = x[t[0]]
    b = x[t[1]] - a
    c = x[t[2]] - a
    return gap_along(axis_of(axis, q - p, b, c), p - a, q - a, b, c)


@wp.func
def pair_clearance(
    pair: int,
    among: wp.vec2i,
    enough: float,  # [m]
    tri: wp.array[int],
    tris: wp.array[wp.vec3i],
    x: wp.array[wp.vec3],
    p: wp.vec3,
    q: wp.vec3,
    apart: Apart,
) -> float:
    """Lower bound [m] on the distance of pq to all its triangles; 0 where it may cross one."""
    least = ALIKE * apart.gap[pair]
    out = float(NONE)
    anew = bool(False)
    for k in range(among[0], among[1]):
        gap = float(0.0)
        t = tris[tri[k]]
        if least > 0.0:
            gap = gap_along_kept(int(apart.axis[k]), t, x, p, q)
        if least == 0.0 or gap < least:
            found = separation(p, q, t, enough, x)
            gap = found.gap
            apart.axis[k] = wp.int8(found.axis)
            anew = True
        if not gap > 0.0:
            apart.gap[pair] = 0.0
            return 0.0
        out = wp.min(out, gap)
    if anew:
        apart.gap[pair] = out
    return out
