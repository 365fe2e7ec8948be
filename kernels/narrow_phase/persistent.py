"""Contacts of edges that go on from step to step.

The impulses on the vertices alone would lead the edges between them across each other. Contacts of
edges that are found only then begin without impulses in every step, and do not reach those that
they need. So a contact of an edge that pressed in the last step is one of the next step from its
start, with the same impulses, as long as the edges, or the edge and the triangle, lie next to each
other. Where it presses no more, it is forgotten.

An edge may have several contacts with one body: they make a list, in the order of their places.
"""

import warp as wp

from warp_contact.kernels.broad_phase.pairs import PairList
from warp_contact.kernels.broad_phase.skins import LEAST
from warp_contact.kernels.geometry import lines_closest, projected_weights
from warp_contact.kernels.mesh import Mesh
from warp_contact.kernels.narrow_phase.edge_contact import EdgeContact
from warp_contact.kernels.narrow_phase.opposing import edge_looks, opposes
from warp_contact.kernels.narrow_phase.surface_query import face_normal
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

LEVEL = wp.constant(0.5)  # cosine by which a contact may turn in a step
# Of the shortest edge: what is further apart after a step was moved by the user, or has parted. The
# margin of the broad phase is wider, so that whatever is closer is among its pairs.
NEAR = wp.constant(0.5 * LEAST)


@wp.func
def follow(
    c: EdgeContact,
    near: float,  # [m]
    e: wp.vec4i,
    tris: wp.array[wp.vec3i],
    x: wp.array[wp.vec3],
):
    """A contact of the last step where its edge is now; not found when there is none any more."""
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
        if wp.dot(c.n, last) < LEVEL:
            return c
        c.t = su[0]
        c.w = wp.vec3(1.0 - su[1], su[1], 0.0)
    else:
        c.n = face_normal(c.vert, x)
        c.w = projected_weights(p + c.t * (q - p), c.n, a, b, x[c.vert[2]])
        if wp.dot(c.n, last) < LEVEL or wp.min(c.w) < 0.0:
            return c
    apart = wp.dot(p + c.t * (q - p) - a, c.n)  # of the lines, or from the plane
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
    x0: wp.array[wp.vec3],  # (n_vert,) [m] start of the step
    # out
    crossing: wp.array[int],  # (capacity + 1,) contacts of the edge with the body, added to
    place: wp.array[int],  # (capacity,) that of the first in ``contact``, where there are any
    contact: wp.array[EdgeContact],  # (contacts,)
    n_place: wp.array[int],  # (1,)
):
    """For each contact of the last step: a place for it and those of the same edge and body."""
    if wp.tid() == 0:
        n_place[0] = n_before[0]
    for first in range(wp.tid(), n_before[0], threads):
        if is_like(first - 1, first, n_before[0], before):
            continue
        body = before[first].body
        e = before[first].edge
        c = pairs.start[e]
        end = wp.min(pairs.start[e + 1], place.shape[0])
        while c < end and pairs.pair[c][1] != body:
            c += 1
        if c >= end:
            continue  # too far from each other
        last = int(-1)
        k = first
        while is_like(k, first, n_before[0], before):
            now = before[k]
            if now.kept[3] > 0.0:
                now = follow(now, NEAR * mesh.edge, mesh.edges[e], mesh.tris, x0)
                if now.found:
                    contact[k] = now
                    crossing[c] = crossing[c] + 1
                    if last < 0:
                        place[c] = k
                    else:
                        contact[last].next = k
                    last = k
            k += 1
