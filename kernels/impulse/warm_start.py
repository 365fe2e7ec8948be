"""Warm start: the impulses of a step start from those of the last step.

A resting body needs almost the same impulses in every step. A vertex keeps the impulse of its first
contact, with the body that it touches. An edge keeps all its contacts with their impulses
(persistent.py). Where the normal has turned, the tangential impulse turns too.

Implicit steps may change their length by half from frame to frame. They keep the impulses over it,
as forces: those of a body at rest are then right for any step. Within a step impulses stay as they
are, as a world that has no new contacts must go on with the same bits.
"""

import warp as wp

from warp_contact.kernels.impulse.constraint import Constraint, Impulse
from warp_contact.kernels.impulse.impulse import part_of
from warp_contact.kernels.impulse.tangent import allowed
from warp_contact.kernels.narrow_phase.contact import Contact
from warp_contact.kernels.narrow_phase.edge_contact import EdgeContact
from warp_contact.kernels.options import OPTIONS
from warp_contact.kernels.worlds import Worlds

wp.set_module_options(OPTIONS)


@wp.func
def turned(p: wp.vec4, n: wp.vec3, mu: float, ramp: wp.vec3) -> wp.vec4:
    """Tangential and normal impulse of the last step where the normal is n now."""
    along = wp.vec3(p[0], p[1], p[2])
    along = allowed(along - wp.dot(along, n) * n, p[3], mu, ramp)
    return wp.vec4(along[0], along[1], along[2], p[3])


@wp.func
def started(p: wp.vec4) -> Impulse:
    """The impulse with which the sweeps begin."""
    out = Impulse()
    out.normal = p[3]
    out.friction = wp.vec3(p[0], p[1], p[2])
    out.ahead = p
    return out


@wp.func
def kept_of(p: Impulse) -> wp.vec4:
    """Tangential and normal impulse, as they are kept for the next step."""
    return wp.vec4(p.friction[0], p.friction[1], p.friction[2], p.normal)


@wp.func
def unit_of(i: int, dt: wp.array[float]) -> float:
    """What kept impulses are divided by: the step of vertex i [s], or 1 where ``dt`` is empty."""
    if dt.shape[0] == 0:
        return 1.0
    return dt[i]


@wp.func
def is_first(c: int, n_vertex: int, contact: wp.array[Contact]) -> bool:
    """Whether contact c is the first of a vertex; they are sorted by vertex."""
    return c < n_vertex and (c == 0 or contact[c - 1].vert[0] != contact[c].vert[0])


@wp.kernel
def recall_vertices(
    # in
    threads: int,
    share: float,  # of the kept impulses: 1 for a whole step
    dt: wp.array[float],  # (n_vert,) [s] where they are kept as forces, or empty
    n_vertex: wp.array[int],  # (1,) contacts of vertices
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    constraint: wp.array[Constraint],  # (capacity,)
    partner: wp.array[int],  # (n_vert,) body of the first contact in the last step, or -1
    kept: wp.array[wp.vec4],  # (n_vert,) [N s] its impulses, [N] in implicit steps
    # in, out
    impulse: wp.array[Impulse],  # (capacity,)
    # out
    part: wp.array[wp.vec3],  # (5 capacity,) [N s] their parts at each vertex
):
    """For each contact: start it from the last step. Those of edges have their impulses already."""
    for c in range(wp.tid(), n_contact[0], threads):
        at = contact[c]
        to = constraint[c]
        i = at.vert[0]
        if to.inv_mass > 0.0 and is_first(c, n_vertex[0], contact) and partner[i] == at.pair[1]:
            last = share * unit_of(i, dt) * kept[i]
            impulse[c] = started(turned(last, at.normal, to.friction, to.ramp))
        p = impulse[c].normal * at.normal + impulse[c].friction
        for k in range(5):
            part[5 * c + k] = part_of(k, at, to, p)


@wp.kernel
def recall_edges(
    # in
    threads: int,
    share: float,  # of the kept impulses: 1 for a whole step
    dt: wp.array[float],  # (n_vert,) [s] where they are kept as forces, or empty
    again: bool,  # the contacts were listed once more: without new ones, a world just goes on
    worlds: Worlds,
    n_vertex: wp.array[int],  # (1,) contacts of vertices
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    constraint: wp.array[Constraint],  # (capacity,)
    source: wp.array[int],  # (capacity,) place of each contact of an edge
    found: wp.array[EdgeContact],  # (capacity,) by place
    # out
    impulse: wp.array[Impulse],  # (capacity,)
):
    """For each contact of an edge: start it from its last impulses; it has no ramp."""
    for c in range(n_vertex[0] + wp.tid(), n_contact[0], threads):
        if constraint[c].inv_mass > 0.0:
            level = wp.vec3(0.0, 0.0, 0.0)
            kept = found[source[c]].kept
            if not again:
                kept = share * unit_of(contact[c].vert[0], dt) * kept
            if not again or worlds.has_new[worlds.of_vert[contact[c].vert[0]]] > 0:
                kept = turned(kept, contact[c].normal, constraint[c].friction, level)
            impulse[c] = started(kept)


@wp.kernel
def keep_vertices(
    # in
    threads: int,
    dt: wp.array[float],  # (n_vert,) [s] where they are kept as forces, or empty
    n_vertex: wp.array[int],  # (1,) contacts of vertices
    contact: wp.array[Contact],  # (capacity,)
    impulse: wp.array[Impulse],  # (capacity,)
    # out
    partner: wp.array[int],  # (n_vert,)
    kept: wp.array[wp.vec4],  # (n_vert,) [N s], [N] in implicit steps
):
    """For each contact of a vertex that is its first: keep its impulses."""
    n = wp.min(n_vertex[0], contact.shape[0])
    for c in range(wp.tid(), n, threads):
        if is_first(c, n, contact):
            i = contact[c].vert[0]
            partner[i] = contact[c].pair[1]
            kept[i] = kept_of(impulse[c]) / unit_of(i, dt)


@wp.kernel
def keep_edges(
    # in
    threads: int,
    dt: wp.array[float],  # (n_vert,) [s] where they are kept as forces, or empty
    look: int,  # worlds have swept where this look found an overlap: the others keep what they had
    worlds: Worlds,
    n_vertex: wp.array[int],  # (1,) contacts of vertices
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    source: wp.array[int],  # (capacity,) place of each contact of an edge
    impulse: wp.array[Impulse],  # (capacity,)
    # in, out
    found: wp.array[EdgeContact],  # (capacity,) by place
    # out
    edges: wp.array[EdgeContact],  # (capacity,) for the next step, sorted by edge and body
    n_edge: wp.array[int],  # (1,)
):
    """For each contact of an edge: keep its impulses, and itself for the next step."""
    if wp.tid() == 0:
        n_edge[0] = wp.max(n_contact[0] - n_vertex[0], 0)
    for c in range(n_vertex[0] + wp.tid(), n_contact[0], threads):
        now = found[source[c]]
        if worlds.open[worlds.of_vert[contact[c].vert[0]]] >= look:
            now.kept = kept_of(impulse[c])
            found[source[c]] = now
        now.kept = now.kept / unit_of(contact[c].vert[0], dt)
        edges[c - n_vertex[0]] = now
