"""Stage 2, edges: surface edges that cross another body with both ends outside of it.

The paper leaves edge against edge out, but its own scenes need it. Crossings are looked for where
the impulses on the vertices lead: with a vertex still inside, its edges would not show. An edge pq
enters N through the triangle t1 and leaves through t2.

    ridge     t1 and t2 share an edge ab: n = +-(pq x ab), on the side of n1 + n2; the contact joins
              the closest points of pq and ab, kept when both lie inside their segments
    face      otherwise: the middle of the inner piece of pq against its closest surface point

The ridge is also left when it is more than twice as far from pq as the middle is from the surface:
an edge that lies flush in a face would else be pushed out sideways through the other faces.
"""

import warp as wp

from warp_contact.kernels.geometry import boxes_meet, lines_closest
from warp_contact.kernels.surface_query import Hit, closest_hit, first_hit, hit_point

wp.set_module_options({"enable_backward": False})


@wp.struct
class Piece:
    enter: Hit
    leave: Hit  # leave.tri is -1 when the edge does not cross


@wp.func
def inner_piece(
    surface: wp.uint64,
    body: int,
    tris: wp.array[wp.vec3i],
    x: wp.array[wp.vec3],
    p: wp.vec3,
    q: wp.vec3,
) -> Piece:
    """First piece of pq inside the body."""
    piece = Piece()
    piece.leave.tri = -1
    piece.enter = first_hit(surface, body, tris, x, p, q - p, 0.0, -1.0)
    if piece.enter.tri >= 0:
        piece.leave = first_hit(surface, body, tris, x, p, q - p, piece.enter.t, 1.0)
    return piece


@wp.kernel
def count_crossings(
    # in
    edge_slots: int,  # of each edge
    surface: wp.uint64,  # Bvh over the triangles, grouped by body
    tris: wp.array[wp.vec3i],  # (n_tri,)
    edges: wp.array[wp.vec4i],  # (n_edge,)
    vert_body: wp.array[int],  # (n_vert,)
    n_near: wp.array[int],  # (n_body,)
    near: wp.array2d[int],  # (n_body, capacity)
    lower: wp.array[wp.vec3],  # (n_body,) [m]
    upper: wp.array[wp.vec3],  # (n_body,) [m]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    count: wp.array[int],  # (n_edge + 1,)
    edge_body: wp.array2d[int],  # (n_edge, edge_slots)
    # out, added to
    needed: wp.array[int],  # edge slots that would have been enough
):
    """One thread per surface edge: the near bodies that it crosses."""
    e = wp.tid()
    m = vert_body[edges[e][0]]
    n = int(0)
    if n_near[m] > 0:
        p = x[edges[e][0]]
        q = x[edges[e][1]]
        for k in range(n_near[m]):
            body = near[m, k]
            if boxes_meet(wp.min(p, q), wp.max(p, q), lower[body], upper[body]):
                piece = inner_piece(surface, body, tris, x, p, q)
                if piece.leave.tri >= 0:
                    if n < edge_slots:
                        edge_body[e, n] = body
                    n += 1
    if n > edge_slots:
        wp.atomic_max(needed, 0, n)
    count[e] = wp.min(n, edge_slots)


@wp.func
def shared_edge(s: wp.vec3i, t: wp.vec3i) -> wp.vec2i:
    """The two common vertices of two triangles; (-1, -1) unless there are exactly two."""
    out = wp.vec2i(-1, -1)
    n = int(0)
    for k in range(3):
        if s[k] == t[0] or s[k] == t[1] or s[k] == t[2]:
            if n < 2:
                out[n] = s[k]
            n += 1
    if n != 2:
        return wp.vec2i(-1, -1)
    return out


@wp.kernel
def edge_contacts(
    # in
    surface: wp.uint64,  # Bvh over the triangles, grouped by body
    tris: wp.array[wp.vec3i],  # (n_tri,)
    edges: wp.array[wp.vec4i],  # (n_edge,)
    vert_body: wp.array[int],  # (n_vert,)
    body_edge: wp.array[float],  # (n_body,) [m]
    hit_start: wp.array[int],  # (n_vert + 1,)
    edge_start: wp.array[int],  # (n_edge + 1,)
    edge_body: wp.array2d[int],  # (n_edge, edge_slots)
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    vert: wp.array2d[int],  # (capacity, 5)
    coef: wp.array2d[float],  # (capacity, 5)
    normal: wp.array[wp.vec3],  # (capacity,)
    depth: wp.array[float],  # (capacity,) [m]
    offset: wp.array[float],  # (capacity,) [m] gap = (sum coef x) . normal - offset
    pair: wp.array[wp.vec2i],  # (capacity,)
):
    """One thread per surface edge: its contacts, behind those of the vertices."""
    e = wp.tid()
    for s in range(edge_start[e + 1] - edge_start[e]):
        c = hit_start[hit_start.shape[0] - 1] + edge_start[e] + s
        if c >= normal.shape[0]:
            return
        body = edge_body[e, s]
        i = edges[e][0]
        j = edges[e][1]
        p = x[i]
        q = x[j]
        piece = inner_piece(surface, body, tris, x, p, q)
        t1 = tris[piece.enter.tri]
        t2 = tris[piece.leave.tri]
        ts = 0.5 * (piece.enter.t + piece.leave.t)
        middle = p + ts * (q - p)
        hit = closest_hit(surface, body, tris, x, middle, 0.1 * body_edge[body])
        t = tris[hit.tri]
        w = hit.w
        gap = hit_point(hit, tris, x) - middle
        d = hit.t
        n = wp.normalize(wp.cross(x[t[1]] - x[t[0]], x[t[2]] - x[t[0]]))
        if wp.dot(gap, n) > 0.0:
            n = wp.normalize(gap)
        ridge = shared_edge(t1, t2)
        if ridge[0] >= 0:
            a = x[ridge[0]]
            b = x[ridge[1]]
            su = lines_closest(p, q, a, b)
            if wp.min(su) >= 0.0 and wp.max(su) <= 1.0:
                side = wp.normalize(wp.cross(x[t1[1]] - x[t1[0]], x[t1[2]] - x[t1[0]]))
                side += wp.normalize(wp.cross(x[t2[1]] - x[t2[0]], x[t2[2]] - x[t2[0]]))
                m = wp.normalize(wp.cross(q - p, b - a))
                if wp.dot(m, side) < 0.0:
                    m = -m
                dr = wp.dot(a + su[1] * (b - a) - p - su[0] * (q - p), m)
                if dr >= 0.0 and dr <= 2.0 * hit.t:
                    ts = su[0]
                    n = m
                    d = dr
                    t = wp.vec3i(ridge[0], ridge[1], ridge[1])
                    w = wp.vec3(1.0 - su[1], su[1], 0.0)
        vert[c, 0] = i
        vert[c, 1] = j
        vert[c, 2] = t[0]
        vert[c, 3] = t[1]
        vert[c, 4] = t[2]
        coef[c, 0] = 1.0 - ts
        coef[c, 1] = ts
        coef[c, 2] = -w[0]
        coef[c, 3] = -w[1]
        coef[c, 4] = -w[2]
        normal[c] = n
        depth[c] = d
        offset[c] = 0.0
        pair[c] = wp.vec2i(vert_body[i], body)
