"""Stage 4, the end: every colliding vertex into the plane of its triangle.

The impulses of stage 5 once more, on positions instead of velocities and with gaps as targets.
With W of impulse.py,

    p <- max(0, p - (g + slack) / W),   x_k += a_k dp n / m_k

The mobility is 1 / m, so the centre of mass of a contact stays where it is. Eq. (1) alone leaves
25 to 38 % of an overlap between a vertex and the middle of a triangle. An overlap that was there
when the step began is left to the search, which knows better than the masses who should yield; in a
step without one it is looked at again first.

A move p n of a pair that slides by u_t changes the angular momentum by p n x u_t. It is handed back
to the velocities as the couple of tangent.py, dv_k = (b_k . p u_t) n / m_k.

slack is what exceeds the largest move of a step, less the resting gap of the impulses: a body that
starts deep inside another would be inverted by a full correction. Contacts without an overlap are
only kept from getting one.
"""

import warp as wp

from warp_contact.kernels.geometry import NONE, projected_weights
from warp_contact.kernels.narrow_phase.gap import REST, gap
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

STRAY = wp.constant(1.0e-3)  # barycentric weight below which a vertex has left its triangle


@wp.kernel
def leftover(
    # in
    threads: int,
    tolerance: float,  # of an edge; less is not worth a move
    deep: float,  # of an edge; less at the start of the step is not worth a search
    strays: bool,  # count a vertex that left its triangle, or lies below it, as an overlap
    n_contact: wp.array[int],  # (1,)
    vert: wp.array2d[int],  # (capacity, 5)
    coef: wp.array2d[float],  # (capacity, 5)
    normal: wp.array[wp.vec3],  # (capacity,)
    offset: wp.array[float],  # (capacity,) [m]
    pair: wp.array[wp.vec2i],  # (capacity,)
    body_edge: wp.array[float],  # (n_body,) [m]
    closing: wp.array[float],  # (capacity,) [m/s] (gap at x0 - gap at rest) / dt
    dt: wp.array[float],  # (1,) [s]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    left: wp.array[float],  # (capacity,) [m], 0 up to the tolerance
    # out, added to
    found: wp.array[int],  # (2,) 1 when any overlap is to be closed, and to be searched
    deep_found: wp.array[int],  # (1,) 1 when any has been to be searched since the frame began
):
    """For each contact: the overlap at x.

    The gap of a vertex is that to a point of its triangle, along a direction that may not be its
    normal: once it has slid it may overlap this or another one all the same.
    """
    for c in range(wp.tid(), n_contact[0], threads):
        left[c] = 0.0
        if wp.length_sq(normal[c]) == 0.0:
            continue
        d = -gap(c, vert, coef, normal, offset, pair[c][1] >= body_edge.shape[0], x)
        edge = body_edge[pair[c][0]]
        if d > tolerance * edge:
            left[c] = d
            found[0] = 1
        if strays and coef[c, 0] == 1.0 and pair[c][1] < body_edge.shape[0]:
            p = x[vert[c, 0]]
            t0 = x[vert[c, 2]]
            t1 = x[vert[c, 3]]
            t2 = x[vert[c, 4]]
            face = wp.normalize(wp.cross(t1 - t0, t2 - t0))
            w = projected_weights(p, normal[c], t0, t1, t2)
            if wp.min(w) < -STRAY or wp.dot(p - t0, face) < -tolerance * edge:
                found[0] = 1
        if d > deep * edge and -closing[c] * dt[0] > deep * edge:
            found[1] = 1
            deep_found[0] = 1


@wp.kernel
def begin_closure(
    # in
    threads: int,
    bound: float,  # largest move in a step, in edges
    deep: float,  # of an edge: an overlap at the start of the step that is left out
    n_contact: wp.array[int],  # (1,)
    pair: wp.array[wp.vec2i],  # (capacity,)
    body_edge: wp.array[float],  # (n_body,) [m]
    closing: wp.array[float],  # (capacity,) [m/s] (gap at x0 - gap at rest) / dt
    dt: wp.array[float],  # (1,) [s]
    left: wp.array[float],  # (capacity,) [m]
    # out
    slack: wp.array[float],  # (capacity,) [m]
    push: wp.array[float],  # (capacity,) [kg m]
):
    """For each contact: what stays for later steps."""
    for c in range(wp.tid(), n_contact[0], threads):
        edge = body_edge[pair[c][0]]
        slack[c] = 0.0
        if left[c] > 0.0:
            slack[c] = wp.max(left[c] - bound * edge, 0.0) - REST * edge
        if -closing[c] * dt[0] > deep * edge:
            slack[c] = NONE
        push[c] = 0.0


@wp.kernel
def solve_gaps(
    # in
    threads: int,
    tolerance: float,  # of an edge
    n_body: int,
    passes: int,  # at most
    n_contact: wp.array[int],  # (1,)
    vert: wp.array2d[int],  # (capacity, 5)
    coef: wp.array2d[float],  # (capacity, 5)
    normal: wp.array[wp.vec3],  # (capacity,)
    offset: wp.array[float],  # (capacity,) [m]
    pair: wp.array[wp.vec2i],  # (capacity,)
    weight: wp.array[float],  # (capacity,) [1/kg] W
    body_edge: wp.array[float],  # (n_body,) [m]
    slack: wp.array[float],  # (capacity,) [m]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    done: wp.array[int],  # (1,) passes so far
    # in, out
    push: wp.array[float],  # (capacity,) [kg m]
    # out
    part: wp.array[wp.vec3],  # (5 capacity,) [kg m] what it moves at each vertex
    # out, added to
    again: wp.array[int],  # (1,) 1 when a gap is still open
):
    """For each contact: what this pass adds to its push."""
    for c in range(wp.tid(), n_contact[0], threads):
        p = float(0.0)
        if weight[c] > 0.0:
            g = gap(c, vert, coef, normal, offset, pair[c][1] >= n_body, x) + slack[c]
            if g < -tolerance * body_edge[pair[c][0]] and done[0] < passes:
                again[0] = 1
            p = wp.max(push[c] - g / weight[c], 0.0)
        for k in range(5):
            part[5 * c + k] = coef[c, k] * (p - push[c]) * normal[c]
        push[c] = p


@wp.kernel
def couples(
    # in
    threads: int,
    n_contact: wp.array[int],  # (1,)
    vert: wp.array2d[int],  # (capacity, 5)
    coef: wp.array2d[float],  # (capacity, 5)
    normal: wp.array[wp.vec3],  # (capacity,)
    turn: wp.array2d[wp.vec3],  # (capacity, 5) [1/m]
    push: wp.array[float],  # (capacity,) [kg m]
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    # out
    part: wp.array[wp.vec3],  # (5 capacity,) [kg m/s] what it hands back at each vertex
):
    """For each contact: the couple that its push leaves behind."""
    for c in range(wp.tid(), n_contact[0], threads):
        u = wp.vec3(0.0, 0.0, 0.0)
        if push[c] > 0.0:
            for k in range(5):
                u += coef[c, k] * v[vert[c, k]]
        for k in range(5):
            part[5 * c + k] = push[c] * wp.dot(turn[c, k], u) * normal[c]
