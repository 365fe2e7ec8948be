"""After the closure: bodies that take implicit steps keep their angular momentum.

The closure moves bodies and leaves velocities. A free body b whose mass M moves by d while its
centre has the velocity v changes the angular momentum by M d x v, and its turning changes its own
part L_b. A contact with the push p [kg m] along n moves both bodies by opposite M d, so

    dL = p n x (v_1 - v_2),      w_b' = I^-1 (L_b + T_b),   T_b = -dL / 2 of each contact

gives all of it back as rotations about the centres, which change no momentum. A body that takes
explicit steps moves at its vertices alone: there v is the velocity of the contact point, and T is
all of the other one. Where one side is held, its holder takes the angular momentum.
"""

import warp as wp

from warp_contact.kernels.implicit.bodies import (
    HELD,
    LUMPED,
    RIGID,
    Implicit,
    RigidMotion,
    as_vec3,
    as_vec3d,
    floats,
    moves,
)
from warp_contact.kernels.implicit.mobility import find_motion
from warp_contact.kernels.impulse.impulse import clear_parts
from warp_contact.kernels.impulse.rows import Touched
from warp_contact.kernels.narrow_phase.contact import Contact, meets_body
from warp_contact.kernels.narrow_phase.contact_graph import ContactGraph, total
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)


@wp.func
def spin_of(
    b: int, x: wp.array[wp.vec3], v: wp.array[wp.vec3], d: Implicit, motion: RigidMotion
) -> wp.vec3d:
    """Angular momentum [kg m^2/s] of body b about its centre, where it was found."""
    spin = wp.vec3d()
    if d.kind[b] == RIGID:
        turn = d.solids.turn[b]
        return turn * (d.solids.inertia[b] * (wp.transpose(turn) * d.solids.w[b]))
    for i in range(d.body_vert[b], d.body_vert[b + 1]):
        u = as_vec3d(v[i] - motion.v[b])
        spin += wp.float64(d.mass[i]) * wp.cross(as_vec3d(x[i] - d.centre[b]), u)
    return spin


@wp.kernel
def find_spin(
    # in
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    # in, out
    d: Implicit,  # found at x; of rigid bodies v and w
    # out
    motion: RigidMotion,  # of v
    spin: wp.array[wp.vec3d],  # (n_body,) [kg m^2/s]
):
    """One thread per body without fixed vertices: its motion and its angular momentum."""
    b = wp.tid()
    if not moves(b, d) or not floats(b, d):
        return
    find_motion(b, v, x, d, motion)
    spin[b] = spin_of(b, x, v, d, motion)


@wp.func
def side_velocity(
    c: Contact,
    first: int,
    last: int,
    b: int,
    v: wp.array[wp.vec3],
    d: Implicit,
    motion: RigidMotion,
) -> wp.vec3:
    """Velocity [m/s] of what the push moves on a side of a contact, its vertices from first on."""
    if d.kind[b] != LUMPED:
        return motion.v[b]
    u = wp.vec3(0.0, 0.0, 0.0)
    for k in range(first, last):
        u += wp.abs(c.coef[k]) * v[c.vert[k]]
    return u


@wp.func
def gives_back(c: Contact, first: int, last: int, b: int, d: Implicit) -> bool:
    """Whether nothing holds a side of a contact."""
    if d.kind[b] == HELD:
        return False
    if d.kind[b] != LUMPED:
        return True
    for k in range(first, last):
        if c.coef[k] != 0.0 and d.inv_mass[c.vert[k]] == 0.0:
            return False
    return True


@wp.kernel
def lost_spin(
    # in
    threads: int,
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    d: Implicit,
    motion: RigidMotion,  # before the closure
    # in, out
    push: wp.array[float],  # (capacity,) [kg m] 0 where it is dealt with
    # out
    part: wp.array[wp.vec3],  # (5 capacity,) [kg m^2/s] for both bodies, at a vertex of each
):
    """For each contact with a body that takes implicit steps: what both get back."""
    for c in range(wp.tid(), n_contact[0], threads):
        clear_parts(c, part)
        at = contact[c]
        if push[c] == 0.0 or not meets_body(at):
            continue
        b1 = d.vert_body[at.vert[0]]
        b2 = d.vert_body[at.vert[2]]
        if d.kind[b1] == LUMPED and d.kind[b2] == LUMPED:
            continue
        if gives_back(at, 0, 2, b1, d) and gives_back(at, 2, 5, b2, d):
            u = side_velocity(at, 0, 2, b1, v, d, motion)
            u -= side_velocity(at, 2, 5, b2, v, d, motion)
            lost = push[c] * wp.cross(at.normal, u)
            if d.kind[b1] != LUMPED and d.kind[b2] != LUMPED:
                lost *= 0.5
            part[5 * c] = -lost
            part[5 * c + 2] = -lost
        push[c] = 0.0


@wp.kernel
def find_rotation(
    # in
    graph: ContactGraph,
    part: wp.array[wp.vec3],  # (5 capacity,) [kg m^2/s]
    touched: Touched,
    busy: wp.array[int],  # (n_body,) 0 where nothing moved the body
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    d: Implicit,  # found at x
    spin: wp.array[wp.vec3d],  # (n_body,) [kg m^2/s] before the closure
    # in, out
    motion: RigidMotion,  # w: of a rigid body, or what is to be added to the rotation of others
):
    """One thread per body: its rotation with the angular momentum that it had, and its part."""
    b = wp.tid()
    if not moves(b, d) or not floats(b, d) or busy[b] == 0:
        return
    to = spin[b]
    first = d.body_vert[b]
    for k in range(touched.n[b]):
        to += as_vec3d(total(touched.vert[first + k], graph, part))
    if d.kind[b] == RIGID:
        turn = d.solids.turn[b]
        w = turn * (d.solids.inverse[b] * (wp.transpose(turn) * to))
        motion.w[b] = as_vec3(w)
    else:
        motion.w[b] = d.inv_inertia[b] * as_vec3(to - spin_of(b, x, v, d, motion))


@wp.kernel
def turn_back(
    # in
    busy: wp.array[int],  # (n_body,)
    d: Implicit,
    motion: RigidMotion,
    # in, out
    x: wp.array[wp.vec3],  # (n_vert,) [m] of rigid bodies: their shape again
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
):
    """One thread per vertex: the motion of its body."""
    i = wp.tid()
    b = d.vert_body[i]
    if not moves(b, d) or not floats(b, d) or busy[b] == 0:
        return
    if d.kind[b] == RIGID:
        turn = d.solids.turn[b]
        arm = turn * as_vec3d(d.rest[i])
        centre = d.solids.at[b] - turn * d.solids.middle[b]
        x[i] = as_vec3(centre + arm)
        v[i] = motion.v[b] + wp.cross(motion.w[b], as_vec3(arm))
    else:
        v[i] = v[i] + wp.cross(motion.w[b], x[i] - d.centre[b])
