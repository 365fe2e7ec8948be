"""How bodies that take implicit steps answer impulses at few vertices, those with contacts.

    dv_i = R_i sum_j B_ij z_j + rigid motion by p,   z_j = R_j^T p_j                    [m/s]

This is G with the rigid part of A0^-1 replaced by that at the present shape, and without P^T, which
would spread each impulse over the whole body: where a body is bent or sheared, its inertia does not
strain it here. In the sweeps of coupled.py touched vertices move by this. The sum of all impulses
then moves all vertices, and P takes out the rigid part of the first term, so that a body gets
exactly the momentum of the impulses. Four neighbouring vertices of a body are summed together; in
the sweeps no list says which, the first of them with contacts does it.
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
    deforms,
    moves,
    vec12,
)
from warp_contact.kernels.implicit.mobility import rigid_motion
from warp_contact.kernels.impulse.rows import (
    RECOUNT,
    Shares,
    Touched,
    begins,
    first_of_four,
    set_row_sums,
    share_of,
)
from warp_contact.kernels.narrow_phase.contact import Contact
from warp_contact.kernels.narrow_phase.contact_graph import ContactGraph, total
from warp_contact.kernels.options import OPTIONS
from warp_contact.kernels.worlds import DONE, Worlds

wp.set_module_options(OPTIONS)


@wp.kernel
def respond(
    # in
    threads: int,
    worlds: Worlds,
    graph: ContactGraph,
    contact: wp.array[Contact],  # (capacity,)
    counted: wp.array[int],  # (capacity,)
    part: wp.array[wp.vec3],  # (5 capacity,) [kg y]
    served: wp.array[int],  # (n_vert,) this sweep where it adds something
    touched: Touched,
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    d: Implicit,
    # out
    busy: wp.array[int],  # (n_body,) 1 where this sweep adds something, 2 where shares change
    motion: RigidMotion,  # by what it adds
    z: wp.array[wp.vec3],  # (n_vert,) [kg y] R^T p
    # in, out
    share: Shares,
    # out, added to
    sum: wp.array[wp.vec3],  # (n_vert,) [kg y] of all sweeps
):
    """For each body in a world that sweeps: what this sweep adds at its vertices."""
    sweep = worlds.sweep[0]
    for b in range(wp.tid(), touched.n.shape[0], threads):
        first = d.body_vert[b]
        busy[b] = 0
        if touched.n[b] == 0 or worlds.doing[worlds.of_vert[first]] == DONE:
            continue
        for k in range(touched.n[b]):
            if served[touched.vert[first + k]] == sweep:
                busy[b] = 1
                break
        if busy[b] == 0:
            continue
        n = int(0)
        recounts = sweep % RECOUNT == 0
        as_whole = moves(b, d)
        pushed = wp.vec3d()
        turning = wp.vec3d()
        for k in range(touched.n[b]):
            i = touched.vert[first + k]
            if recounts or begins(i, graph, counted):
                s = share_of(i, graph, contact, counted)
                if s != share.of_vert[i]:
                    share.vert[first + n] = i
                    share.by[first + n] = s - share.of_vert[i]
                    share.of_vert[i] = s
                    n += 1
                    busy[b] = 2
            z[i] = wp.vec3(0.0, 0.0, 0.0)
            if served[i] == sweep:
                p = total(i, graph, part)
                sum[i] = sum[i] + p
                if as_whole:
                    pushed += as_vec3d(p)
                    turning += wp.cross(as_vec3d(x[i] - d.centre[b]), as_vec3d(p))
                    z[i] = wp.transpose(d.turn[i]) * p
                else:
                    z[i] = p
        share.n[b] = n
        if as_whole:
            motion.v[b] = d.inv_total[b] * as_vec3(pushed)
            motion.w[b] = d.inv_inertia[b] * as_vec3(turning)


@wp.func
def product_of_touched(four: int, z: wp.array[wp.vec3], touched: Touched, d: Implicit) -> vec12:
    """Rows of B z of four vertices, where z is 0 but at touched ones."""
    b = d.vert_body[four]
    first = d.body_vert[b]
    at = block_of(four, d) - first
    by_x = vec12()
    by_y = vec12()
    by_z = vec12()
    for k in range(touched.n[b]):
        j = touched.vert[first + k]
        rows = d.block[at + j]
        q = z[j]
        by_x += rows[0] * q[0]
        by_y += rows[1] * q[1]
        by_z += rows[2] * q[2]
    return by_x + by_y + by_z


@wp.func
def velocity(
    i: int, strain: wp.vec3, z: wp.vec3, x: wp.vec3, motion: RigidMotion, d: Implicit
) -> wp.vec3:
    """Answer of vertex i, where B z is ``strain``."""
    b = d.vert_body[i]
    if not moves(b, d):
        return d.inv_mass[i] * z
    u = motion.v[b] + wp.cross(motion.w[b], x - d.centre[b])
    if d.kind[b] != RIGID:
        u += d.turn[i] * strain
    return u


@wp.kernel
def move(
    # in
    threads: int,
    worlds: Worlds,
    dt: wp.array[float],  # (n_vert,) [s]
    graph: ContactGraph,
    touched: Touched,
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    z: wp.array[wp.vec3],  # (n_vert,) [kg y]
    share: Shares,
    busy: wp.array[int],  # (n_body,)
    motion: RigidMotion,  # by what this sweep adds
    d: Implicit,
    # in, out
    y: wp.array[wp.vec3],  # (n_vert,) velocities or positions
    row: wp.array[float],  # (n_vert,) [1/kg]
    # out
    changed: wp.array[int],  # (n_vert,) this sweep where it changed y, else an older one
):
    """For each vertex with contacts, of a body that is busy: how it answers, and its row sum.

    Four at once.
    """
    sweep = worlds.sweep[0]
    for t in range(wp.tid(), graph.n_touched[0], threads):
        four = first_of_four(graph.touched[t], graph, d)
        if four < 0:
            continue
        b = d.vert_body[four]
        if busy[b] == 0:
            continue
        if busy[b] == 2:
            set_row_sums(four, sweep % RECOUNT == 0, graph, share, touched, x, d, row)
        s = vec12()
        if deforms(b, d):
            s = product_of_touched(four, z, touched, d)
        for k in range(FOUR):
            i = four + k
            if i < d.body_vert[b + 1] and graph.start[i] < graph.start[i + 1]:
                if d.inv_mass[i] > 0.0:
                    u = wp.vec3(s[3 * k], s[3 * k + 1], s[3 * k + 2])
                    u = velocity(i, u, z[i], x[i], motion, d)
                    y[i] = y[i] + u
                    if wp.length(u) * dt[i] > worlds.negligible[worlds.of_vert[i]]:
                        changed[i] = sweep


@wp.kernel
def gather(
    # in
    threads: int,
    p: wp.array[wp.vec3],  # (n_vert,) [kg y], 0 without contacts
    touched: Touched,
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    d: Implicit,
    # out
    busy: wp.array[int],  # (n_body,) 1 where there is anything to answer
    motion: RigidMotion,  # by p
    z: wp.array[wp.vec3],  # (n_vert,) [kg y] R^T p
):
    """For each body that takes implicit steps: the impulses at its vertices with contacts."""
    for b in range(wp.tid(), touched.n.shape[0], threads):
        busy[b] = 0
        if not moves(b, d):
            continue
        first = d.body_vert[b]
        pushed = wp.vec3d()
        turning = wp.vec3d()
        for k in range(touched.n[b]):
            i = touched.vert[first + k]
            z[i] = wp.vec3(0.0, 0.0, 0.0)
            if acts(p[i]):
                busy[b] = 1
                pushed += as_vec3d(p[i])
                turning += wp.cross(as_vec3d(x[i] - d.centre[b]), as_vec3d(p[i]))
                z[i] = wp.transpose(d.turn[i]) * p[i]
        rigid_motion(b, pushed, turning, d, motion)


@wp.kernel
def multiply(
    # in
    z: wp.array[wp.vec3],  # (n_vert,) [kg y], at vertices with contacts
    touched: Touched,
    d: Implicit,
    busy: wp.array[int],  # (n_body,)
    # out
    y: wp.array[wp.vec3],  # (n_vert,) R B z
):
    """One thread per vertex: the first quarter of those of a body have four each."""
    t = wp.tid()
    b = d.vert_body[t]
    first = d.body_vert[b]
    four = first + FOUR * (t - first)
    if busy[b] == 0 or d.kind[b] == RIGID or four >= d.body_vert[b + 1]:
        return
    s = product_of_touched(four, z, touched, d)
    for k in range(FOUR):
        if four + k < d.body_vert[b + 1]:
            y[four + k] = d.turn[four + k] * wp.vec3(s[3 * k], s[3 * k + 1], s[3 * k + 2])
