"""Stage 2, edges: which surface edges cross another body, and the contact records of those.

Crossings are looked for where the impulses on the vertices lead.
"""

import warp as wp

from warp_contact.kernels.candidates import CAREFUL, gap_to
from warp_contact.kernels.edge_contact import EdgeContact, edge_contact
from warp_contact.kernels.geometry import NONE, projected_crossing, projected_weights
from warp_contact.kernels.vertex_contact import SLIP

wp.set_module_options({"enable_backward": False})

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


@wp.kernel
def find_crossings(
    # in
    threads: int,
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
    way: wp.array[float],  # (n_body,) [m]
    x0: wp.array[wp.vec3],  # (n_vert,) [m] start of the step
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # in, out
    wake: wp.array[float],  # (capacity,) [m] way of both bodies until which there is no crossing
    # out
    crossing: wp.array[int],  # (capacity + 1,) 1 where an edge makes a contact, 0 elsewhere
    place: wp.array[int],  # (capacity,) index in ``contact`` where ``crossing`` is 1
    contact: wp.array[EdgeContact],  # (contacts,) in any order
    # out, added to
    n_place: wp.array[int],  # (1,)
):
    """For each candidate, and for the room behind them.

    Contacts that do not fit are left out; ``total_contacts`` counts crossings and asks for room.
    """
    for c in range(wp.tid(), crossing.shape[0], threads):
        crossing[c] = 0
        if c >= n_pair[0]:
            continue
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
        if found.found:
            crossing[c] = 1
            k = wp.atomic_add(n_place, 0, 1)
            place[c] = k
            if k < contact.shape[0]:
                contact[k] = found


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
):
    """For each candidate: its contact, behind those of the vertices."""
    for k in range(wp.tid(), n_pair[0], threads):
        c = n_hit[0] + crossing_at[k]
        if crossing_at[k + 1] == crossing_at[k]:
            continue
        if c >= normal.shape[0] or place[k] >= contact.shape[0]:
            continue
        e = edges[pair[k][0]]
        i = e[0]
        j = e[1]
        body = pair[k][1]
        found = contact[place[k]]
        t = found.vert
        w = found.w
        if found.ridge:
            su = wp.vec2(found.t, w[1])
            start = projected_crossing(x0[i], x0[j], x0[t[0]], x0[t[1]], found.n)
            if wp.length(start - su) < SLIP:
                found.t = start[0]
                w = wp.vec3(1.0 - start[1], start[1], 0.0)
        else:
            middle = x0[i] + found.t * (x0[j] - x0[i])
            start_w = projected_weights(middle, found.n, x0[t[0]], x0[t[1]], x0[t[2]])
            if wp.length(start_w - w) < SLIP:
                w = start_w
        vert[c, 0] = i
        vert[c, 1] = j
        vert[c, 2] = t[0]
        vert[c, 3] = t[1]
        vert[c, 4] = t[2]
        coef[c, 0] = 1.0 - found.t
        coef[c, 1] = found.t
        coef[c, 2] = -w[0]
        coef[c, 3] = -w[1]
        coef[c, 4] = -w[2]
        normal[c] = found.n
        depth[c] = found.d
        offset[c] = 0.0
        pair_of[c] = wp.vec2i(vert_body[i], body)
