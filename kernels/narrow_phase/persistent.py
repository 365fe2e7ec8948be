"""Persistent contacts of edges: those with an impulse in the last step start the next one.

Impulses on the vertices alone would lead the edges between them across each other. If contacts of
edges were found only after these impulses, they would start without an impulse in every step, and
end with too small ones. A contact of an edge that had an impulse in the last step is therefore a
contact of the next step from its start, with the same impulse, as long as the edges, or the edge
and the triangle, lie next to each other. A contact without an impulse is dropped.

An edge may have several contacts with one body: they form a list, in the order of their places.
"""

import warp as wp

from warp_contact.kernels.broad_phase.pairs import PairList
from warp_contact.kernels.geometry import lines_closest, projected_weights
from warp_contact.kernels.lengths import PERSISTENT
from warp_contact.kernels.mesh import Mesh
from warp_contact.kernels.narrow_phase.edge_contact import EdgeContact
from warp_contact.kernels.narrow_phase.opposing import edge_looks, opposes
from warp_contact.kernels.narrow_phase.surface_query import face_normal
from warp_contact.kernels.options import OPTIONS
from warp_contact.kernels.worlds import Worlds

wp.set_module_options(OPTIONS)

MOST_TURN = wp.constant(0.5)  # cosine by which a contact may turn in a step


@wp.func
def follow(
    c: EdgeContact,
    near: float,  # [m]
    e: wp.vec4i,
    tris: wp.array[wp.vec3i],
    x: wp.array[wp.vec3],
):
    """A contact of the last step at the present positions; not found if it has ended."""
    p = x[e[0]]
    q = x[e[1]]
    a = x[c.vert[0]]
    b = x[c.vert[1]]
    last = c.n
    c.found = False
    c.next = -1
    c.d = 0.0
    if c.ridge:
        su = lines_closest(p, q, a, b)
        if wp.min(su) < 0.0 or wp.max(su) > 1.0:
            return c
        c.n = wp.normalize(wp.cross(q - p, b - a))
        if wp.dot(c.n, last) < 0.0:
            c.n = -c.n
        if wp.dot(c.n, last) < MOST_TURN:
            return c
        c.t = su[0]
        c.w = wp.vec3(1.0 - su[1], su[1], 0.0)
    else:
        c.n = face_normal(c.vert, x)
        c.w = projected_weights(p + c.t * (q - p), c.n, a, b, x[c.vert[2]])
        if wp.dot(c.n, last) < MOST_TURN or wp.min(c.w) < 0.0:
            return c
    apart = wp.dot(p + c.t * (q - p) - a, c.n)  # distance between the lines, or from the plane
    if wp.abs(apart) > near:
        return c
    c.found = opposes(edge_looks(tris[e[2]], tris[e[3]], c.n, x))
    return c


@wp.func
def is_like(k: int, of: int, n: int, before: wp.array[EdgeContact]) -> bool:
    """Whether contact k is of the same edge and body as another."""
    if k < 0 or k >= n:
        return False
    return before[k].edge == before[of].edge and before[k].body == before[of].body


@wp.kernel
def continue_contacts(
    # in
    threads: int,
    n_before: wp.array[int],  # (1,)
    before: wp.array[EdgeContact],  # (contacts,) of the last step, sorted by edge and body
    pairs: PairList,  # edges and bodies
    mesh: Mesh,
    worlds: Worlds,
    x0: wp.array[wp.vec3],  # (n_vert,) [m] start of the step
    # out
    crossing: wp.array[int],  # (capacity + 1,) contacts of the edge with the body, added to
    place: wp.array[int],  # (capacity,) of its first contact in ``contact``, -1 for none
    contact: wp.array[EdgeContact],  # (contacts,) those of the last step keep their places
):
    """For each contact of the last step: keep it, with those of the same edge and body.

    None persists where bodies may overlap and are moved apart.
    """
    for first in range(wp.tid(), n_before[0], threads):
        if is_like(first - 1, first, n_before[0], before):
            continue
        body = before[first].body
        e = before[first].edge
        if worlds.apart[worlds.of_vert[mesh.edges[e][0]]] == 0:
            continue
        c = pairs.start[e]
        end = wp.min(pairs.start[e + 1], place.shape[0])
        while c < end and pairs.pair[c][1] != body:
            c += 1
        if c >= end:
            continue  # no pair any more: too far apart
        last = int(-1)
        k = first
        while is_like(k, first, n_before[0], before):
            now = before[k]
            if now.kept[3] > 0.0:
                near = PERSISTENT * mesh.shortest_edge[body]
                now = follow(now, near, mesh.edges[e], mesh.tris, x0)
                if now.found:
                    contact[k] = now
                    crossing[c] = crossing[c] + 1
                    if last < 0:
                        place[c] = k
                    else:
                        contact[last].next = k
                    last = k
            k += 1
