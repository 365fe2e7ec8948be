"""Contacts of edges that go on from step to step.

The impulses on the vertices alone would lead the edges between them across each other, so that
contacts of edges found there begin without impulses in every step, and end far from what they need.
What pressed in the last step is therefore a contact of the next one from its start, with the same
impulses, as long as the edges, or the edge and the triangle, lie next to each other. Where it is no
longer needed it stops to press, and is forgotten.

An edge may have several contacts with one body: they make a list, in the order of their places.
"""

import warp as wp

from warp_contact.kernels.broad_phase.margins import LEAST
from warp_contact.kernels.geometry import lines_closest, projected_weights
from warp_contact.kernels.impulse.tangent import turned
from warp_contact.kernels.narrow_phase.edge_contact import EdgeContact
from warp_contact.kernels.narrow_phase.opposing import edge_looks, opposes
from warp_contact.kernels.narrow_phase.surface_query import face_normal
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

LEVEL = wp.constant(0.5)  # cosine by which a contact may turn in a step
# Of the shortest edge: what is further apart after a step was moved by the user, or has parted. A
# skin is wider, so that whatever is closer is among the candidates, however old these are.
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
    before = c.n
    c.found = False
    c.next = -1
    c.d = 0.0
    if c.ridge:
        su = lines_closest(p, q, a, b)
        if wp.min(su) < 0.0 or wp.max(su) > 1.0:
            return c
        c.n = wp.normalize(wp.cross(q - p, b - a))
        if wp.dot(c.n, before) < 0.0:
            c.n = -c.n
        if wp.dot(c.n, before) < LEVEL:
            return c
        c.t = su[0]
        c.w = wp.vec3(1.0 - su[1], su[1], 0.0)
    else:
        c.n = face_normal(c.vert, x)
        c.w = projected_weights(p + c.t * (q - p), c.n, a, b, x[c.vert[2]])
        if wp.dot(c.n, before) < LEVEL or wp.min(c.w) < 0.0:
            return c
    apart = wp.dot(p + c.t * (q - p) - a, c.n)  # of the lines, or from the plane
    if wp.abs(apart) > near:
        return c
    c.found = opposes(edge_looks(tris[e[2]], tris[e[3]], c.n, x))
    return c


@wp.func
def goes_on(k: int, of: int, n: int, held: wp.array[EdgeContact]) -> bool:
    """Whether contact k is of the same edge and body as another."""
    if k < 0 or k >= n:
        return False
    return held[k].edge == held[of].edge and held[k].body == held[of].body


@wp.kernel
def hold(
    # in
    threads: int,
    edge: float,  # shortest mean edge of a body [m]
    n_held: wp.array[int],  # (1,)
    held: wp.array[EdgeContact],  # (contacts,) of the last step, sorted by edge and body
    start: wp.array[int],  # (n_edge + 1,) candidates of each edge
    pair: wp.array[wp.vec2i],  # (capacity,) edge and body
    edges: wp.array[wp.vec4i],  # (n_edge,)
    tris: wp.array[wp.vec3i],  # (n_tri,)
    x0: wp.array[wp.vec3],  # (n_vert,) [m] start of the step
    # out
    crossing: wp.array[int],  # (capacity + 1,) contacts of the edge with the body, added to
    place: wp.array[int],  # (capacity,) that of the first in ``contact``, where there are any
    contact: wp.array[EdgeContact],  # (contacts,)
    n_place: wp.array[int],  # (1,)
):
    """For each contact of the last step: a place for it and those of the same edge and body."""
    if wp.tid() == 0:
        n_place[0] = n_held[0]
    for first in range(wp.tid(), n_held[0], threads):
        if goes_on(first - 1, first, n_held[0], held):
            continue
        body = held[first].body
        e = held[first].edge
        c = start[e]
        end = wp.min(start[e + 1], place.shape[0])
        while c < end and pair[c][1] != body:
            c += 1
        if c >= end:
            continue  # too far from each other
        last = int(-1)
        k = first
        while goes_on(k, first, n_held[0], held):
            now = held[k]
            if now.kept[3] > 0.0:
                now = follow(now, NEAR * edge, edges[e], tris, x0)
                if now.found:
                    contact[k] = now
                    crossing[c] = crossing[c] + 1
                    if last < 0:
                        place[c] = k
                    else:
                        contact[last].next = k
                    last = k
            k += 1


@wp.kernel
def recall(
    # in
    threads: int,
    n_hit: wp.array[int],  # (1,)
    n_contact: wp.array[int],  # (1,)
    normal: wp.array[wp.vec3],  # (capacity,)
    weight: wp.array[float],  # (capacity,) [1/kg]
    mu: wp.array[float],  # (capacity,)
    source: wp.array[int],  # (capacity,)
    contact: wp.array[EdgeContact],  # (contacts,)
    # out
    lam: wp.array[float],  # (capacity,) [N s]
    slip: wp.array[wp.vec3],  # (capacity,) [N s]
    ahead: wp.array[wp.vec4],  # (capacity,) [N s]
):
    """For each contact of an edge: go on from its impulses."""
    for c in range(n_hit[0] + wp.tid(), n_contact[0], threads):
        if weight[c] > 0.0:
            p = turned(contact[source[c]].kept, normal[c], mu[c], wp.vec3(0.0, 0.0, 0.0))
            lam[c] = p[3]
            slip[c] = wp.vec3(p[0], p[1], p[2])
            ahead[c] = p


@wp.kernel
def keep(
    # in
    threads: int,
    n_hit: wp.array[int],  # (1,)
    n_contact: wp.array[int],  # (1,)
    source: wp.array[int],  # (capacity,)
    lam: wp.array[float],  # (capacity,) [N s]
    slip: wp.array[wp.vec3],  # (capacity,) [N s]
    # in, out
    contact: wp.array[EdgeContact],  # (contacts,)
    # out
    held: wp.array[EdgeContact],  # (contacts,)
    n_held: wp.array[int],  # (1,)
):
    """For each contact of an edge: keep its impulses, and itself for the next step."""
    if wp.tid() == 0:
        n_held[0] = wp.max(n_contact[0] - n_hit[0], 0)
    for c in range(n_hit[0] + wp.tid(), n_contact[0], threads):
        now = contact[source[c]]
        now.kept = wp.vec4(slip[c][0], slip[c][1], slip[c][2], lam[c])
        contact[source[c]] = now
        held[c - n_hit[0]] = now
