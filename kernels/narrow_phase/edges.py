"""Stage 2, edges: which surface edges cross another body, and the contact records of those.

Crossings are looked for where the impulses on the vertices lead.
"""

import warp as wp

from warp_contact.kernels.broad_phase.edges import gap_to
from warp_contact.kernels.broad_phase.margins import CAREFUL
from warp_contact.kernels.geometry import NONE, projected_crossing, projected_weights
from warp_contact.kernels.narrow_phase.edge_contact import EdgeContact, edge_contact, is_same
from warp_contact.kernels.narrow_phase.vertex_contact import SLIP
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

AHEAD = wp.constant(16.0)  # looks: a distance that lasts so long need not be known any better


@wp.func
def clearance(
    among: wp.vec2i,
    enough: float,  # [m]
    tri: wp.array[int],
    tris: wp.array[wp.vec3i],
    x: wp.array[wp.vec3],
    p: wp.vec3,
    q: wp.vec3,
) -> float:
    """A distance [m] that pq keeps from all triangles, 0 where it may cross one."""
    out = float(NONE)
    for k in range(among[0], among[1]):
        gap = gap_to(p, q, tris[tri[k]], enough, x)
        if not gap > 0.0:
            return 0.0
        out = wp.min(out, gap)
    return out


@wp.func
def is_among(found: EdgeContact, first: int, contact: wp.array[EdgeContact]) -> bool:
    """Whether a list of contacts has the one that was found."""
    k = first
    while k >= 0:
        if is_same(found, contact[k]):
            return True
        k = contact[k].next
    return False


@wp.kernel
def find_crossings(
    # in
    threads: int,
    hold: bool,  # contacts that have a place stay
    fresh: bool,  # there are no overlaps from before the step
    skin: wp.array[float],  # (n_body,) [m]
    n_pair: wp.array[int],  # (1,)
    pair: wp.array[wp.vec2i],  # (capacity,) edge and body
    pair_tris: wp.array[wp.vec2i],  # (capacity,) first and end in ``tri``
    tri: wp.array[int],  # (capacity,)
    surface: wp.uint64,  # Bvh over the triangles, grouped by body
    tris: wp.array[wp.vec3i],  # (n_tri,)
    edges: wp.array[wp.vec4i],  # (n_edge,)
    vert_body: wp.array[int],  # (n_vert,)
    body_edge: wp.array[float],  # (n_body,) [m]
    pace: wp.array[float],  # (n_body,) [m]
    way: wp.array[float],  # (n_body + n_plane,) [m]
    x0: wp.array[wp.vec3],  # (n_vert,) [m] start of the step
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # in, out
    wake: wp.array[float],  # (capacity,) [m] way of both bodies until which there is no crossing
    place: wp.array[int],  # (capacity,) that of the first in ``contact``, where there are any
    contact: wp.array[EdgeContact],  # (contacts,) in any order
    # out
    crossing: wp.array[int],  # (capacity + 1,) contacts of the edge with the body
    # out, added to
    n_place: wp.array[int],  # (1,)
    n_new: wp.array[int],  # (1,) contacts found
):
    """For each candidate, and for the room behind them.

    Contacts that do not fit are left out; ``total_contacts`` counts crossings and asks for room.
    """
    for c in range(wp.tid(), crossing.shape[0], threads):
        crossing[c] = 0
        if c >= n_pair[0]:
            continue
        if not hold:
            place[c] = -1
        last = place[c]
        if last >= 0:
            crossing[c] = 1
            while contact[last].next >= 0:
                last = contact[last].next
                crossing[c] = crossing[c] + 1
        e = edges[pair[c][0]]
        i = e[0]
        j = e[1]
        body = pair[c][1]
        spent = way[vert_body[i]] + way[body]
        reach = skin[vert_body[i]] + skin[body]
        if spent < wake[c]:
            continue
        enough = wp.min(AHEAD * (pace[vert_body[i]] + pace[body]), reach)
        clear = clearance(pair_tris[c], enough, tri, tris, x, x[i], x[j])
        wake[c] = spent + CAREFUL * clear
        if clear > 0.0:
            continue
        edge = body_edge[body]
        found = edge_contact(
            surface, body, edge, fresh, reach, pair_tris[c], tri, tris, x0, x, edges[pair[c][0]]
        )
        if not found.found or (last >= 0 and is_among(found, place[c], contact)):
            continue
        crossing[c] = crossing[c] + 1
        wp.atomic_add(n_new, 0, 1)
        k = wp.atomic_add(n_place, 0, 1)
        if k >= contact.shape[0]:
            continue
        found.edge = pair[c][0]
        found.body = body
        found.next = -1
        contact[k] = found
        if last < 0:
            place[c] = k
        else:
            contact[last].next = k


@wp.func
def at_start(c: EdgeContact, i: int, j: int, x: wp.array[wp.vec3]) -> EdgeContact:
    """The contact of the edge from i to j with its weights at the start of the step."""
    t = c.vert
    if c.ridge:
        start = projected_crossing(x[i], x[j], x[t[0]], x[t[1]], c.n)
        if wp.length(start - wp.vec2(c.t, c.w[1])) < SLIP:
            c.t = start[0]
            c.w = wp.vec3(1.0 - start[1], start[1], 0.0)
    else:
        own = x[i] + c.t * (x[j] - x[i])
        w = projected_weights(own, c.n, x[t[0]], x[t[1]], x[t[2]])
        if wp.length(w - c.w) < SLIP:
            c.w = w
    return c


@wp.kernel
def edge_contacts(
    # in
    threads: int,
    n_pair: wp.array[int],  # (1,)
    pair: wp.array[wp.vec2i],  # (capacity,) edge and body
    edges: wp.array[wp.vec4i],  # (n_edge,)
    vert_body: wp.array[int],  # (n_vert,)
    n_hit: wp.array[int],  # (1,)
    crossing_at: wp.array[int],  # (capacity + 1,) contacts before each candidate
    place: wp.array[int],  # (capacity,)
    contact: wp.array[EdgeContact],  # (contacts,)
    x0: wp.array[wp.vec3],  # (n_vert,) [m] start of the step, for the weights
    # out
    vert: wp.array2d[int],  # (capacity, 5)
    coef: wp.array2d[float],  # (capacity, 5)
    normal: wp.array[wp.vec3],  # (capacity,)
    depth: wp.array[float],  # (capacity,) [m]
    offset: wp.array[float],  # (capacity,) [m] gap = (sum coef x) . normal - offset
    pair_of: wp.array[wp.vec2i],  # (capacity,)
    source: wp.array[int],  # (capacity,) place of the contact in ``contact``
):
    """For each candidate: its contacts, behind those of the vertices."""
    for k in range(wp.tid(), n_pair[0], threads):
        c = n_hit[0] + crossing_at[k]
        end = n_hit[0] + crossing_at[k + 1]
        i = edges[pair[k][0]][0]
        j = edges[pair[k][0]][1]
        at = place[k]
        while c < wp.min(end, normal.shape[0]) and at >= 0:
            found = at_start(contact[at], i, j, x0)
            vert[c, 0] = i
            vert[c, 1] = j
            coef[c, 0] = 1.0 - found.t
            coef[c, 1] = found.t
            for m in range(3):
                vert[c, 2 + m] = found.vert[m]
                coef[c, 2 + m] = -found.w[m]
            normal[c] = found.n
            depth[c] = found.d
            offset[c] = 0.0
            pair_of[c] = wp.vec2i(vert_body[i], pair[k][1])
            source[c] = at
            at = found.next
            c += 1
