"""Where bodies are, what they weigh, and how rigid ones lie and move.

    c = sum m x / sum m,   I = sum m (|r|^2 1 - r r^T),   r = x - c                 [m], [kg m^2]

A rigid body has a mass, a centre and an inertia I_0 of its own. Its vertices, q from the centre in
the shape at rest, have its motion; with weights m, and q_m and x_m their means, they say

    R   the rotation that takes q - q_m nearest to x - x_m             (Kabsch 1976, Wahba 1965)
    c = x_m - R q_m,   I = R I_0 R^T                                                [m], [kg m^2]
    w = J^-1 sum m (x - x_m) x v,   J = R J_0 R^T,   J_0 = sum m (|s|^2 1 - s s^T),   s = q - q_m
    v_c = sum m v / sum m + w x (c - x_m)                                                  [m/s]

R is found from the polar part of sum m (x - x_m) s^T F, F = (sum m s s^T)^-1, and one step of
Gauss and Newton: the polar part takes the thin direction of a plate for as exact as the others.
"""

import warp as wp

from warp_contact.kernels.implicit.bodies import (
    HELD,
    RIGID,
    Implicit,
    RigidMotion,
    as_mat33,
    as_mat33d,
    as_vec3,
    as_vec3d,
    moves,
    polar,
    rotation,
)
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)


@wp.func
def centre_of(b: int, x: wp.array[wp.vec3], d: Implicit) -> wp.vec3:
    """Centre of mass [m] of body b, which is not rigid."""
    first = d.body_vert[b]
    origin = x[first]
    total = wp.float64(0.0)
    moment = wp.vec3d()
    for i in range(first, d.body_vert[b + 1]):
        m = wp.float64(d.mass[i])
        total += m
        moment += m * as_vec3d(x[i] - origin)
    return origin + as_vec3(moment / total)


@wp.func
def find_solid(b: int, x: wp.array[wp.vec3], d: Implicit):
    """Set where rigid body b is, and how it answers impulses."""
    first = d.body_vert[b]
    origin = as_vec3d(x[first])
    total = wp.float64(0.0)
    moment = wp.vec3d()
    now = wp.mat33d()
    for i in range(first, d.body_vert[b + 1]):
        m = wp.float64(d.mass[i])
        r = as_vec3d(x[i]) - origin
        total += m
        moment += m * r
        now += m * wp.outer(r, as_vec3d(d.rest[i]) - d.solids.middle[b])
    turn = as_mat33d(polar(as_mat33(now @ d.solids.spread[b])))
    turn = wp.float64(0.5) * (turn + wp.transpose(wp.inverse(turn)))  # its rounding
    k = now @ wp.transpose(turn)
    off = wp.vec3d(k[2, 1] - k[1, 2], k[0, 2] - k[2, 0], k[1, 0] - k[0, 1])
    turn = rotation(turn * (d.solids.inverse_of_vertices[b] * (wp.transpose(turn) * off))) @ turn
    at = origin + moment / total
    d.solids.at[b] = at
    d.solids.turn[b] = turn
    d.centre[b] = as_vec3(at - turn * d.solids.middle[b])
    d.inv_total[b] = wp.float32(wp.float64(1.0) / total)
    d.inv_inertia[b] = as_mat33(turn @ d.solids.inverse[b] @ wp.transpose(turn))


@wp.func
def find_solid_motion(
    b: int, y: wp.array[wp.vec3], x: wp.array[wp.vec3], d: Implicit, motion: RigidMotion
):
    """Set the motion of rigid body b by velocities y [m/s] of its vertices, where it was found."""
    first = d.body_vert[b]
    at = d.solids.at[b]
    turn = d.solids.turn[b]
    total = wp.float64(0.0)
    moving = wp.vec3d()
    turning = wp.vec3d()
    for i in range(first, d.body_vert[b + 1]):
        m = wp.float64(d.mass[i])
        q = m * as_vec3d(y[i] - y[first])
        total += m
        moving += q
        turning += wp.cross(as_vec3d(x[i]) - at, q)
    w = turn * (d.solids.inverse_of_vertices[b] * (wp.transpose(turn) * turning))
    to_centre = turn * d.solids.middle[b]
    v = as_vec3d(y[first]) + moving / total - wp.cross(w, to_centre)
    d.solids.v[b] = v
    d.solids.w[b] = w
    motion.v[b] = as_vec3(v)
    motion.w[b] = as_vec3(w)


@wp.kernel
def find_bodies(
    # in
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # in, out
    d: Implicit,
):
    """One thread per body: its centre, mass and inertia at the present shape."""
    b = wp.tid()
    d.inv_total[b] = 0.0
    d.inv_inertia[b] = wp.mat33(0.0)
    if not moves(b, d):
        return
    if d.kind[b] == RIGID:
        find_solid(b, x, d)
        return
    first = d.body_vert[b]
    last = d.body_vert[b + 1]
    c = centre_of(b, x, d)
    d.centre[b] = c
    if d.kind[b] == HELD:
        return
    total = wp.float64(0.0)
    inertia = wp.mat33d()
    for i in range(first, last):
        total += wp.float64(d.mass[i])
        r = as_vec3d(x[i] - c)
        inertia += wp.float64(d.mass[i]) * (
            wp.dot(r, r) * wp.identity(n=3, dtype=wp.float64) - wp.outer(r, r)
        )
    scale = wp.trace(inertia)
    inverse = wp.inverse(inertia / scale)
    d.inv_total[b] = wp.float32(wp.float64(1.0) / total)
    d.inv_inertia[b] = as_mat33(inverse / scale)
