"""Conjugate gradients for one implicit step, for all bodies at once and each by itself.

    A(x) dv = r,   A = M + h C(x) + h^2 K(x)                                          [kg]

The mobility G of mobility.py is the preconditioner. A is indefinite where tets are pressed hard.
A body ends where a direction comes up along which A is less than LEAST of M: the curvature there is
negative, or so near to 0 that dv would have no bound. In free flight r is what rounding of
positions by ROUNDING |x| does to forces, about (1 / G_ii - m_i) / h for each vertex: a body ends
where r . G r is no larger than that.

The last product G r, which says what is left, is not lost: where an iteration left little, G r is
almost what is missing in dv. It is added, and leaves about the same part as that iteration.
"""

import warp as wp

from warp_contact.kernels.implicit.bodies import FOUR, RIGID, Implicit, block_of, moves
from warp_contact.kernels.motion.motion import corner_sum
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

TOLERANCE = wp.constant(1.0e-3)  # of the first residual, in the norm of G
ROUNDING = wp.constant(2.5e-7)  # of a coordinate, in float32, and what follows from it
NEAR = wp.constant(0.1)  # part of r . G r that is left: less, and G is almost the inverse of A
LEAST = wp.constant(wp.float64(0.5))  # of p . M p: with a smaller p . A p a body ends
ITERATIONS = wp.constant(16)  # at most: two are usual


@wp.struct
class Iteration:
    """Where the iterations of each body are."""

    going: wp.array[int]  # (n_body,) its number; 0 where it has ended, -1 where it is about to
    enough: wp.array[wp.float64]  # (n_body,) r . G r at which it ends [J]
    now: wp.array[wp.float64]  # (n_body,) the same now [J]


@wp.func
def inner(a: wp.array[wp.vec3], b: wp.array[wp.vec3], first: int, last: int) -> wp.float64:
    s = wp.float64(0.0)
    for i in range(first, last):
        s += wp.float64(wp.dot(a[i], b[i]))
    return s


@wp.kernel
def multiply(
    # in
    vt_start: wp.array[int],  # (n_vert + 1,)
    vt_corner: wp.array[int],  # (4 n_tet,)
    stiff: wp.array[wp.vec3],  # (4 n_tet,) corners of K p [N/s]
    damped: wp.array[wp.vec3],  # (4 n_tet,) corners of C p [N]; empty without damping
    d: Implicit,
    chosen: wp.array[int],  # (n_body,) not 0 where the product is needed; empty if everywhere
    p: wp.array[wp.vec3],  # (n_vert,) [m/s]
    # out
    product: wp.array[wp.vec3],  # (n_vert,) [kg m/s]
):
    """One thread per vertex: A p of the bodies that are chosen; 0 at fixed vertices."""
    i = wp.tid()
    if chosen.shape[0] > 0:
        if chosen[d.vert_body[i]] == 0:
            return
    b = d.vert_body[i]
    product[i] = wp.vec3(0.0, 0.0, 0.0)
    if d.inv_mass[i] > 0.0 and moves(b, d):
        h = d.h[b]
        s = d.mass[i] * p[i] + h * h * corner_sum(i, vt_start, vt_corner, stiff)
        if damped.shape[0] > 0:
            s += h * corner_sum(i, vt_start, vt_corner, damped)
        product[i] = s


@wp.kernel
def begin(
    # in
    r: wp.array[wp.vec3],  # (n_vert,) [kg m/s]
    z: wp.array[wp.vec3],  # (n_vert,) [m/s] G r
    d: Implicit,
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    to: Iteration,
    p: wp.array[wp.vec3],  # (n_vert,) [m/s] the first direction, 0 where there is nothing to do
    # out, added to
    running: wp.array[int],  # (1,) bodies that go on
):
    """One thread per body: begin to iterate where there is anything to do."""
    b = wp.tid()
    to.going[b] = 0
    first = d.body_vert[b]
    last = d.body_vert[b + 1]
    for i in range(first, last):
        p[i] = wp.vec3(0.0, 0.0, 0.0)
    if not moves(b, d):
        return
    noise = wp.float64(0.0)
    if d.kind[b] != RIGID:
        for i in range(first, last):
            g = d.norm[block_of(i, d) + i - first][(i - first) % FOUR]
            if g > 0.0:
                p_i = (1.0 / g - d.mass[i]) / d.h[b] * ROUNDING * wp.length(x[i])
                noise += wp.float64(g * p_i * p_i)
    rz = inner(r, z, first, last)
    to.now[b] = rz
    to.enough[b] = wp.max(wp.float64(TOLERANCE * TOLERANCE) * rz, noise)
    if rz > to.enough[b]:
        to.going[b] = 1
        wp.atomic_add(running, 0, 1)
        for i in range(first, last):
            p[i] = z[i]


@wp.kernel
def go(
    # in
    p: wp.array[wp.vec3],  # (n_vert,) [m/s]
    ap: wp.array[wp.vec3],  # (n_vert,) [kg m/s] A p
    d: Implicit,
    # in, out
    to: Iteration,
    dv: wp.array[wp.vec3],  # (n_vert,) [m/s]
    r: wp.array[wp.vec3],  # (n_vert,) [kg m/s]
):
    """One thread per body: go along p to the least energy."""
    b = wp.tid()
    if to.going[b] == 0:
        return
    first = d.body_vert[b]
    last = d.body_vert[b + 1]
    curvature = inner(p, ap, first, last)
    inertia = wp.float64(0.0)
    for i in range(first, last):
        inertia += wp.float64(d.mass[i] * wp.length_sq(p[i]))
    along = float(0.0)
    if curvature > LEAST * inertia:
        along = wp.float32(to.now[b] / curvature)
    else:
        if to.going[b] == 1:
            along = 1.0  # G r, what the shape at rest would do
        to.going[b] = -1
    for i in range(first, last):
        dv[i] = dv[i] + along * p[i]
        r[i] = r[i] - along * ap[i]


@wp.kernel
def look(
    # in
    r: wp.array[wp.vec3],  # (n_vert,) [kg m/s]
    z: wp.array[wp.vec3],  # (n_vert,) [m/s] G r
    d: Implicit,
    # in, out
    to: Iteration,
    p: wp.array[wp.vec3],  # (n_vert,) [m/s]
    dv: wp.array[wp.vec3],  # (n_vert,) [m/s]
    # out, added to
    running: wp.array[int],  # (1,) bodies that go on
):
    """One thread per body: whether it has converged when z is added; else the next direction."""
    b = wp.tid()
    if to.going[b] == 0:
        return
    first = d.body_vert[b]
    last = d.body_vert[b + 1]
    rz = inner(r, z, first, last)
    keep = wp.float32(rz / to.now[b])
    near = to.going[b] > 0 and keep < NEAR
    left = rz
    if near:
        left = wp.float64(keep) * rz  # with z added
    if to.going[b] < 0 or left <= to.enough[b] or to.going[b] == ITERATIONS:
        to.going[b] = 0
        wp.atomic_sub(running, 0, 1)
        for i in range(first, last):  # nothing of it is multiplied any more
            p[i] = wp.vec3(0.0, 0.0, 0.0)
            if near:
                dv[i] = dv[i] + z[i]
        return
    to.now[b] = rz
    to.going[b] = to.going[b] + 1
    for i in range(first, last):
        p[i] = z[i] + keep * p[i]
