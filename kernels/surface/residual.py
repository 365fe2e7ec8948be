"""Residual overlaps after the impulses, and vertices that left their triangle or lie below it.

The gap of a vertex is that to a point of its triangle, along a direction that may not be the normal
of the triangle. A vertex that has slid may therefore overlap this or another triangle although this
gap shows no overlap. Within a step it can come to lie no deeper below another one than it has moved
relative to its own, as it overlapped none before.
"""

import warp as wp

from warp_contact.kernels.geometry import projected_weights
from warp_contact.kernels.impulse.constraint import Constraint, Impulse
from warp_contact.kernels.lengths import CLOSURE_TOLERANCE, OLD_OVERLAP
from warp_contact.kernels.narrow_phase.contact import Contact, gap, relative_velocity
from warp_contact.kernels.options import OPTIONS
from warp_contact.kernels.worlds import FIRST_LOOK, Worlds

wp.set_module_options(OPTIONS)

STRAY = wp.constant(1.0e-3)  # barycentric weight below which a vertex has left its triangle

# Places in ``found``.
OPEN = wp.constant(0)  # some overlap is to be closed
OLD = wp.constant(1)  # some overlap is for the search: it is older than the step
WORLDS = wp.constant(2)  # from here on, for each world: ``open``, ``old``, ``was_old`` of worlds.py


@wp.kernel
def residual_gaps(
    # in
    threads: int,
    look: int,  # worlds count where the look before this one found an overlap
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    constraint: wp.array[Constraint],  # (capacity,)
    dt: wp.array[float],  # (n_vert,) [s]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    residual: wp.array[float],  # (capacity,) [m], 0 up to the tolerance
    # out, added to
    worlds: Worlds,  # those with an overlap to be closed, or for the search
    found: wp.array[int],  # (2 + 3 n_world,) 1 where it is true
):
    """For each contact: its overlap at x."""
    for c in range(wp.tid(), n_contact[0], threads):
        residual[c] = 0.0
        at = contact[c]
        if wp.length_sq(at.normal) == 0.0:
            continue
        d = -gap(at, x)
        edge = at.edge_length
        world = worlds.of_vert[at.vert[0]]
        if d > CLOSURE_TOLERANCE * edge:
            residual[c] = d
            if worlds.open[world] >= look - 1:
                worlds.open[world] = look
                found[OPEN] = 1
        old = -constraint[c].gap_bound * dt[at.vert[0]]
        if d > OLD_OVERLAP * edge and old > OLD_OVERLAP * edge:
            if worlds.apart[world] == 0 and worlds.open[world] >= look - 1:
                worlds.old[world] = 1
                worlds.was_old[world] = 1
                found[OLD] = 1


@wp.kernel
def find_strays(
    # in
    threads: int,
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    dt: wp.array[float],  # (n_vert,) [s]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    v: wp.array[wp.vec3],  # (n_vert,) [m/s] by which they moved in the step
    # out, added to
    worlds: Worlds,  # those with an overlap to be closed
    found: wp.array[int],  # (2 + 3 n_world,) 1 for an overlap
):
    """For each contact of a vertex with a triangle: whether it slid off it, or lies below it.

    Not where bodies may have overlapped when the step began.
    """
    for c in range(wp.tid(), n_contact[0], threads):
        at = contact[c]
        if at.coef[0] != 1.0 or at.on_plane:
            continue
        if wp.length_sq(at.normal) == 0.0:
            continue
        world = worlds.of_vert[at.vert[0]]
        if worlds.apart[world] == 0:
            continue
        p = x[at.vert[0]]
        t0 = x[at.vert[2]]
        t1 = x[at.vert[3]]
        t2 = x[at.vert[4]]
        face = wp.normalize(wp.cross(t1 - t0, t2 - t0))
        w = projected_weights(p, at.normal, t0, t1, t2)
        least = CLOSURE_TOLERANCE * at.edge_length
        below = wp.dot(p - t0, face) < -least
        slid = dt[at.vert[0]] * wp.length(relative_velocity(at, v)) > least
        if below or (slid and wp.min(w) < -STRAY):
            worlds.open[world] = FIRST_LOOK
            found[OPEN] = 1


@wp.kernel
def keep_contacts(
    # in
    threads: int,
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    impulse: wp.array[Impulse],  # (capacity,)
    # out
    n_kept: wp.array[int],  # (1,)
    kept: wp.array[Contact],  # (capacity,)
    kept_impulse: wp.array[Impulse],  # (capacity,)
):
    """For each contact: keep it, with its impulses, before others take its place."""
    if wp.tid() == 0:
        n_kept[0] = n_contact[0]
    for c in range(wp.tid(), n_contact[0], threads):
        kept[c] = contact[c]
        kept_impulse[c] = impulse[c]
