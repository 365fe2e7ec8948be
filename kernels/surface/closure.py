"""Stage 8, closure: put every vertex that overlaps into the plane of its triangle.

The iteration of the impulses, on positions instead of velocities and with gaps as targets.
With W of constraint.py,

    p <- max(0, p - (g + slack) / W),   x_k += a_k dp n / m_k

The mobility is 1 / m, so the centre of mass of a contact stays where it is. Eq. (1) alone leaves
25 to 38 % of an overlap between a vertex and the middle of a triangle. An overlap older than the
step is left to the search, which balances pressures, not masses. In a step without search it waits
for a second detection pass, which may find a better plane.

A move p n of a contact that slides by u_t changes the angular momentum by p n x u_t. The velocities
get it back as the torque of tangent.py, dv_k = (b_k . p u_t) n / m_k.

slack is the overlap beyond the largest move of a step, less the resting gap of the impulses: a full
correction would invert a body that starts deep inside another. Contacts without an overlap are only
kept from getting one.
"""

import warp as wp

from warp_contact.kernels.geometry import NONE
from warp_contact.kernels.impulse.constraint import Constraint
from warp_contact.kernels.lengths import CLOSURE_TOLERANCE, REST_GAP
from warp_contact.kernels.mobility import Mobility, mobility_of
from warp_contact.kernels.narrow_phase.contact import Contact, gap, relative_velocity
from warp_contact.kernels.options import OPTIONS
from warp_contact.kernels.worlds import DONE, Worlds, ask

wp.set_module_options(OPTIONS)

PASSES = wp.constant(128)  # at most; corners that meet need more than 32


@wp.kernel
def begin_closure(
    # in
    threads: int,
    limits: wp.vec3,  # see below, in edges
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    constraint: wp.array[Constraint],  # (capacity,)
    dt: wp.array[float],  # (n_vert,) [s]
    residual: wp.array[float],  # (capacity,) [m]
    worlds: Worlds,
    soft: Mobility,  # of what the search may move
    # out
    slack: wp.array[float],  # (capacity,) [m]
    push: wp.array[float],  # (capacity,) [kg m]
):
    """For each contact: the overlap that is left to later steps.

    The limits are the overlap at the start of the step beyond which a contact is left out, in
    worlds where bodies may have overlapped before and in those where they were apart, and the
    largest move in a step.
    """
    for c in range(wp.tid(), n_contact[0], threads):
        edge = contact[c].edge_length
        slack[c] = 0.0
        if residual[c] > 0.0:
            slack[c] = wp.max(residual[c] - limits[2] * edge, 0.0) - REST_GAP * edge
        i = contact[c].vert[0]
        if -constraint[c].gap_bound * dt[i] > limits[worlds.apart[worlds.of_vert[i]]] * edge:
            for k in range(5):
                if mobility_of(contact[c].vert[k], soft) > 0.0:
                    slack[c] = NONE
        push[c] = 0.0


@wp.kernel
def solve_gaps(
    # in
    threads: int,
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    constraint: wp.array[Constraint],  # (capacity,)
    slack: wp.array[float],  # (capacity,) [m]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # in, out
    push: wp.array[float],  # (capacity,) [kg m]
    # out
    part: wp.array[wp.vec3],  # (5 capacity,) [kg m] what it moves at each vertex
    # out, added to
    worlds: Worlds,  # those where an overlap is left
):
    """For each contact of a world that is being closed: what this pass adds to its push."""
    for c in range(wp.tid(), n_contact[0], threads):
        at = contact[c]
        world = worlds.of_vert[at.vert[0]]
        if worlds.doing[world] == DONE:
            continue
        p = float(0.0)
        w = constraint[c].inv_mass
        if w > 0.0:
            g = gap(at, x) + slack[c]
            if g < -CLOSURE_TOLERANCE * at.edge_length:
                ask(worlds, world, PASSES, True)
            p = wp.max(push[c] - g / w, 0.0)
        for k in range(5):
            part[5 * c + k] = at.coef[k] * (p - push[c]) * at.normal
        push[c] = p


@wp.kernel
def torques(
    # in
    threads: int,
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    constraint: wp.array[Constraint],  # (capacity,)
    push: wp.array[float],  # (capacity,) [kg m]
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    # out
    part: wp.array[wp.vec3],  # (5 capacity,) [kg m/s] what it hands back at each vertex
):
    """For each contact: the torque that makes up for its push."""
    for c in range(wp.tid(), n_contact[0], threads):
        at = contact[c]
        u = wp.vec3(0.0, 0.0, 0.0)
        if push[c] > 0.0:
            u = relative_velocity(at, v)
        for k in range(5):
            part[5 * c + k] = push[c] * wp.dot(constraint[c].turn[k], u) * at.normal
