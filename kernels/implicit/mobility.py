"""How a body that takes implicit steps answers impulses at its vertices.

    G  = P S P^T + U M_r^-1 U^T                 dv = G p          mobility            [1/kg]
    S_ij = R_i (A0^-1)_ij R_j^T                 A0 = M + h C0 + h^2 K0                 [kg]
    P  = 1 - U M_r^-1 U^T M,  M_r = U^T M U     U the rigid motions at the present shape
    A0^-1 = B + U0 M_r0^-1 U0^T                 U0 those at rest                       [1/kg]

A0 is the matrix of an implicit step of the shape at rest. Its inverse is made once for each shape,
material and length of the step, and shared by all bodies of that shape. R_i turns the rest shape
into the present one around vertex i: the polar part of the mean deformation gradient of its tets.
The part B of A0^-1 that deforms the body is stored without the rigid one, beside which that of a
stiff body would be lost in rounding.
P takes the rigid part out of a velocity, P^T that of an impulse, so that a body gets exactly the
linear and angular momentum of the impulses, whatever S is. A body with fixed vertices has S alone.
"""

import warp as wp

from warp_contact.kernels.implicit.bodies import (
    FOUR,
    RIGID,
    Implicit,
    RigidMotion,
    acts,
    as_vec3,
    as_vec3d,
    block_of,
    floats,
    moves,
    rigid_at,
    vec12,
)
from warp_contact.kernels.implicit.masses import find_solid_motion
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)


@wp.func
def rigid_motion(b: int, total: wp.vec3d, turning: wp.vec3d, d: Implicit, motion: RigidMotion):
    """Set the rigid motion of body b by linear and angular momentum."""
    motion.v[b] = d.inv_total[b] * as_vec3(total)
    motion.w[b] = d.inv_inertia[b] * as_vec3(turning)


@wp.func
def find_response(
    b: int, p: wp.array[wp.vec3], x: wp.array[wp.vec3], d: Implicit, motion: RigidMotion
) -> bool:
    """Set the rigid motion of body b by impulses p [kg m/s]; whether there are any."""
    c = d.centre[b]
    total = wp.vec3d()
    turning = wp.vec3d()
    found = bool(False)
    for i in range(d.body_vert[b], d.body_vert[b + 1]):
        if acts(p[i]):
            found = True
            q = as_vec3d(p[i])
            total += q
            turning += wp.cross(as_vec3d(x[i] - c), q)
    rigid_motion(b, total, turning, d, motion)
    return found


@wp.func
def find_rigid_part(
    b: int, y: wp.array[wp.vec3], x: wp.array[wp.vec3], d: Implicit, motion: RigidMotion
):
    """Set the rigid part of velocities y [m/s] of body b, which deforms."""
    c = d.centre[b]
    total = wp.vec3d()
    turning = wp.vec3d()
    for i in range(d.body_vert[b], d.body_vert[b + 1]):
        q = wp.float64(d.mass[i]) * as_vec3d(y[i])
        total += q
        turning += wp.cross(as_vec3d(x[i] - c), q)
    rigid_motion(b, total, turning, d, motion)


@wp.func
def find_motion(
    b: int, y: wp.array[wp.vec3], x: wp.array[wp.vec3], d: Implicit, motion: RigidMotion
):
    """Set the rigid part of velocities y [m/s] of body b, which has no fixed vertices."""
    if d.kind[b] == RIGID:
        find_solid_motion(b, y, x, d, motion)
    else:
        find_rigid_part(b, y, x, d, motion)


@wp.kernel
def rigid_response(
    # in
    p: wp.array[wp.vec3],  # (n_vert,) [kg m/s]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    d: Implicit,
    # out
    motion: RigidMotion,
):
    """One thread per body: its rigid motion by impulses."""
    b = wp.tid()
    if moves(b, d):
        find_response(b, p, x, d, motion)


@wp.kernel
def rigid_part(
    # in
    y: wp.array[wp.vec3],  # (n_vert,) [m/s]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # in, out
    d: Implicit,  # of rigid bodies v and w
    # out
    motion: RigidMotion,
):
    """One thread per body without fixed vertices: the rigid part of velocities."""
    b = wp.tid()
    if moves(b, d) and floats(b, d):
        find_motion(b, y, x, d, motion)


@wp.kernel
def to_rest(
    # in
    p: wp.array[wp.vec3],  # (n_vert,) [kg m/s]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    d: Implicit,
    chosen: wp.array[int],  # (n_body,) 0 where no answer is needed; empty if all are
    # out
    motion: RigidMotion,  # by p
    rest: RigidMotion,  # motion at rest by z
    busy: wp.array[int],  # (n_body,) 1 where there is anything to answer
    z: wp.array[wp.vec3],  # (n_vert,) [kg m/s]
):
    """One thread per body: z = R^T P^T p, and the rigid motions by p and z."""
    b = wp.tid()
    busy[b] = 0
    if not moves(b, d):
        return
    if chosen.shape[0] > 0:
        if chosen[b] == 0:
            return
    if not find_response(b, p, x, d, motion):
        return
    busy[b] = 1
    if d.kind[b] == RIGID:
        return
    total = wp.vec3d()
    turning = wp.vec3d()
    for i in range(d.body_vert[b], d.body_vert[b + 1]):
        z[i] = wp.vec3(0.0, 0.0, 0.0)
        if d.inv_mass[i] > 0.0:
            q = wp.transpose(d.turn[i]) * (p[i] - d.mass[i] * rigid_at(i, b, x[i], d, motion))
            z[i] = q
            total += as_vec3d(q)
            turning += wp.cross(as_vec3d(d.rest[i]), as_vec3d(q))
    rest.v[b] = d.inv_total[b] * as_vec3(total)
    rest.w[b] = wp.vec3(0.0, 0.0, 0.0)
    if floats(b, d):
        rest.w[b] = d.rest_inertia[b] * as_vec3(turning)


@wp.kernel
def multiply(
    # in
    z: wp.array[wp.vec3],  # (n_vert,) [kg m/s]
    d: Implicit,
    rest: RigidMotion,  # motion at rest by z
    busy: wp.array[int],  # (n_body,)
    # out
    y: wp.array[wp.vec3],  # (n_vert,) [m/s]
):
    """One thread per vertex: R A0^-1 z; the first quarter of those of a body have four each."""
    t = wp.tid()
    b = d.vert_body[t]
    first = d.body_vert[b]
    last = d.body_vert[b + 1]
    own = first + FOUR * (t - first)
    if busy[b] == 0 or d.kind[b] == RIGID or own >= last:
        return
    at = block_of(own, d) - first
    by_x = vec12()  # three sums, of which none waits for another
    by_y = vec12()
    by_z = vec12()
    for j in range(first, last):
        rows = d.block[at + j]
        q = z[j]
        by_x += rows[0] * q[0]
        by_y += rows[1] * q[1]
        by_z += rows[2] * q[2]
    s = by_x + by_y + by_z
    for k in range(FOUR):
        i = own + k
        if i < last:
            u = rest.v[b] + wp.cross(rest.w[b], d.rest[i])
            y[i] = d.turn[i] * (u + wp.vec3(s[3 * k], s[3 * k + 1], s[3 * k + 2]))


@wp.kernel
def correct(
    # in
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    d: Implicit,
    right: RigidMotion,  # by the impulses
    busy: wp.array[int],  # (n_body,)
    # out
    wrong: RigidMotion,  # with the velocities y
    # in, out
    y: wp.array[wp.vec3],  # (n_vert,) [m/s]
):
    """One thread per body: give y the rigid motion that it should have; 0 where nothing is busy."""
    b = wp.tid()
    free = busy[b] != 0 and floats(b, d)
    if free and d.kind[b] != RIGID:
        find_rigid_part(b, y, x, d, wrong)
    for i in range(d.body_vert[b], d.body_vert[b + 1]):
        if busy[b] == 0:
            y[i] = wp.vec3(0.0, 0.0, 0.0)
        elif d.kind[b] == RIGID:
            y[i] = rigid_at(i, b, x[i], d, right)
        elif free:
            y[i] = y[i] - rigid_at(i, b, x[i], d, wrong) + rigid_at(i, b, x[i], d, right)
