"""Conjugate gradients for one implicit step, for all bodies at once and each by itself.

    A(x) dv = r,   A = M + h C(x) + h^2 K(x)                                          [kg]

The mobility G of mobility.py is the preconditioner. A is indefinite where tets are pressed hard;
a body ends where a direction of negative curvature comes up.
"""

import warp as wp

from warp_contact.kernels.implicit.mobility import Implicit, moves
from warp_contact.kernels.motion.motion import corner_sum
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

TOLERANCE = wp.constant(1.0e-3)  # of the first residual, in the norm of G
ITERATIONS = wp.constant(16)  # at most: two are usual


@wp.struct
class Iteration:
    """Where the iterations of each body are."""

    going: wp.array[int]  # (n_body,) its number, 0 where it has ended
    first: wp.array[wp.float64]  # (n_body,) r . G r at the start [J]
    now: wp.array[wp.float64]  # (n_body,) the same now [J]
    along: wp.array[float]  # (n_body,) how far to go along the direction
    keep: wp.array[float]  # (n_body,) part of the old direction in the next


@wp.func
def product(a: wp.array[wp.vec3], b: wp.array[wp.vec3], first: int, last: int) -> wp.float64:
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
    p: wp.array[wp.vec3],  # (n_vert,) [m/s]
    # out
    product: wp.array[wp.vec3],  # (n_vert,) [kg m/s]
):
    """One thread per vertex: A p; 0 at fixed vertices."""
    i = wp.tid()
    product[i] = wp.vec3(0.0, 0.0, 0.0)
    if d.inv_mass[i] > 0.0 and moves(d.vert_body[i], d):
        h = d.h[0]
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
    # out
    to: Iteration,
    # out, added to
    running: wp.array[int],  # (1,) bodies that go on
):
    """One thread per body: begin to iterate where there is anything to do."""
    b = wp.tid()
    to.going[b] = 0
    if moves(b, d):
        rz = product(r, z, d.body_vert[b], d.body_vert[b + 1])
        to.first[b] = rz
        to.now[b] = rz
        if rz > wp.float64(0.0):
            to.going[b] = 1
            wp.atomic_add(running, 0, 1)


@wp.kernel
def find_length(
    # in
    p: wp.array[wp.vec3],  # (n_vert,) [m/s]
    ap: wp.array[wp.vec3],  # (n_vert,) [kg m/s] A p
    d: Implicit,
    # in, out
    to: Iteration,
):
    """One thread per body: how far to go along p."""
    b = wp.tid()
    to.along[b] = 0.0
    if to.going[b] == 0:
        return
    curvature = product(p, ap, d.body_vert[b], d.body_vert[b + 1])
    if curvature > wp.float64(0.0):
        to.along[b] = wp.float32(to.now[b] / curvature)
    else:
        if to.going[b] == 1:
            to.along[b] = 1.0
        to.going[b] = -1


@wp.kernel
def go(
    # in
    d: Implicit,
    to: Iteration,
    p: wp.array[wp.vec3],  # (n_vert,) [m/s]
    ap: wp.array[wp.vec3],  # (n_vert,) [kg m/s]
    # in, out
    dv: wp.array[wp.vec3],  # (n_vert,) [m/s]
    r: wp.array[wp.vec3],  # (n_vert,) [kg m/s]
):
    """One thread per vertex: go along p."""
    i = wp.tid()
    b = d.vert_body[i]
    if to.along[b] != 0.0:
        dv[i] = dv[i] + to.along[b] * p[i]
        r[i] = r[i] - to.along[b] * ap[i]


@wp.kernel
def look(
    # in
    r: wp.array[wp.vec3],  # (n_vert,) [kg m/s]
    z: wp.array[wp.vec3],  # (n_vert,) [m/s] G r
    d: Implicit,
    # in, out
    to: Iteration,
    # out, added to
    running: wp.array[int],  # (1,) bodies that go on
):
    """One thread per body: whether it has converged."""
    b = wp.tid()
    if to.going[b] == 0:
        return
    rz = product(r, z, d.body_vert[b], d.body_vert[b + 1])
    enough = rz <= wp.float64(TOLERANCE * TOLERANCE) * to.first[b]
    if to.going[b] < 0 or enough or to.going[b] == ITERATIONS:
        to.going[b] = 0
        wp.atomic_sub(running, 0, 1)
        return
    to.keep[b] = wp.float32(rz / to.now[b])
    to.now[b] = rz
    to.going[b] = to.going[b] + 1


@wp.kernel
def find_direction(
    # in
    d: Implicit,
    to: Iteration,
    z: wp.array[wp.vec3],  # (n_vert,) [m/s]
    # in, out
    p: wp.array[wp.vec3],  # (n_vert,) [m/s]
):
    """One thread per vertex: the next direction."""
    i = wp.tid()
    b = d.vert_body[i]
    if to.going[b] > 0:
        p[i] = z[i] + to.keep[b] * p[i]
