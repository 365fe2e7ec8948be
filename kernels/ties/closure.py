"""Ties in the closure: positions alone, which become no velocities.

Bodies turn, and rigid ones get their shape again: what was closed to first order is open by
the square of the way. It is closed here,

    r = -C(x)                                                                               [m]

as the next step would make velocities of it. A tie that moves its bodies by P = M d while their
centres have other velocities changes the angular momentum, which both get back:

    dL = P x (v_1 - v_2),     T_b = -dL / 2              [kg m], as in surface/coupled_spin.py
"""

import warp as wp

from warp_contact.kernels.implicit.bodies import (
    HELD,
    LUMPED,
    RIGID,
    Implicit,
    RigidMotion,
    acts,
    as_vec3,
    as_vec3d,
    moves,
)
from warp_contact.kernels.impulse.rows import Touched
from warp_contact.kernels.options import OPTIONS
from warp_contact.kernels.ties import tie
from warp_contact.kernels.ties.tie import Tied, Ties, across, gap
from warp_contact.kernels.worlds import FIRST_LOOK, Worlds

wp.set_module_options(OPTIONS)


@wp.kernel
def find_moved(
    # in
    impulse: wp.array[wp.vec3],  # (n_vert,) [kg m] of the contacts
    touched: Touched,
    ties: Ties,
    tied: Tied,
    d: Implicit,
    # out
    busy: wp.array[int],  # (n_body,) 1 where contacts or ties moved it
):
    """One thread per body: whether the closure moved it."""
    b = wp.tid()
    busy[b] = 0
    if not moves(b, d):
        return
    for k in range(touched.n[b]):
        if acts(impulse[touched.vert[d.body_vert[b] + k]]):
            busy[b] = 1
    for k in range(tied.start[b], tied.start[b + 1]):
        for e in range(tied.first[k], tied.first[k + 1]):
            if wp.length_sq(ties.since[tied.entry[e] // 8]) > wp.float64(0.0):
                busy[b] = 1


@wp.kernel
def find_left(
    # in
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # in, out
    ties: Ties,
):
    """One thread per tie: r of one that is hard, in a cluster that the closure moved."""
    t = wp.tid()
    r = wp.vec3d()
    if ties.state[t] == tie.HELD and ties.compliance[t] == 0.0 and ties.moved[ties.cluster[t]] != 0:
        r = -across(gap(t, ties.now[t], ties.at[t], ties, x), as_vec3d(ties.line[t]))
    ties.pull[t] = r


@wp.kernel
def restore(
    # in
    busy: wp.array[int],  # (n_body,)
    tied: Tied,
    d: Implicit,  # found at x
    # in, out
    x: wp.array[wp.vec3],  # (n_vert,) [m]
):
    """One thread per vertex: the shape of rigid bodies with ties that moved."""
    i = wp.tid()
    b = d.vert_body[i]
    if moves(b, d) and d.kind[b] == RIGID and busy[b] != 0 and tied.start[b] < tied.start[b + 1]:
        arm = d.solids.turn[b] * (as_vec3d(d.rest[i]) - d.solids.middle[b])
        x[i] = as_vec3(d.solids.at[b] + arm)


@wp.func
def is_free(b: int, d: Implicit) -> bool:
    return d.kind[b] != HELD and d.kind[b] != LUMPED


@wp.kernel
def give_back(
    # in
    ties: Ties,
    tied: Tied,
    d: Implicit,
    motion: RigidMotion,  # before the closure
    # in, out
    spin: wp.array[wp.vec3d],  # (n_body,) [kg m^2/s]
):
    """One thread per body: what its ties to others that nothing holds give back."""
    b = wp.tid()
    if not moves(b, d) or not is_free(b, d):
        return
    for k in range(tied.start[b], tied.start[b + 1]):
        for e in range(tied.first[k], tied.first[k + 1]):
            t = tied.entry[e] // 8
            one = d.vert_body[ties.vert[t][0]]
            other = d.vert_body[ties.vert[t][4]]
            if ties.to_world[t] == 0 and is_free(one, d) and is_free(other, d):
                part = wp.float64(0.5 * ties.now[t][tied.entry[e] % 8])
                if b == other:
                    part = -part  # its weights have the sum -1
                u = as_vec3d(motion.v[one] - motion.v[other])
                spin[b] = spin[b] - part * wp.cross(ties.since[t], u)


@wp.kernel
def look_again(
    # in
    ties: Ties,
    # in, out
    worlds: Worlds,
):
    """One thread per tie: its world looks for overlaps a second time."""
    worlds.open[worlds.of_vert[ties.vert[wp.tid()][0]]] = FIRST_LOOK
