"""Stage 2, edges: surface edges that cross another body.

The paper leaves edge against edge out, but its own scenes need it. Crossings are looked for where
the impulses on the vertices lead. An edge pq enters N through the triangle t1 and leaves by t2.

    ridge     t1 and t2 share an edge ab: n = +-(pq x ab), on the side of n1 + n2; the contact joins
              the closest points of pq and ab, kept when both lie inside their segments
    face      otherwise: the middle of the inner piece of pq against its closest surface point

The ridge is also left when it is more than twice as far from pq as the middle is from the surface:
an edge that lies flush in a face would else be pushed out sideways through the other faces. And it
is left for the face when it would have overlapped more at the start of the step already: the lines
have passed each other.

With one end inside, the triangle closest to that end stands for t2, and only a ridge makes a
contact: the vertex has one of its own, but where two rims cross it lies beside the overlap.
"""

import warp as wp

from warp_contact.kernels.geometry import (
    boxes_meet,
    lines_closest,
    projected_crossing,
    projected_weights,
)
from warp_contact.kernels.penetration import SLIP, STALE
from warp_contact.kernels.surface_query import Hit, closest_hit, first_crossing, hit_point

wp.set_module_options({"enable_backward": False})

FLAT = wp.constant(2.0e-4)  # of an edge: an edge this deep lies in the face, whatever its direction


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


@wp.struct
class EdgeContact:
    found: bool
    t: float  # place on pq
    n: wp.vec3
    d: float  # [m]
    vert: wp.vec3i  # of N
    w: wp.vec3  # their weights
    ridge: bool
    close: bool  # whether the edge came close enough to be looked at


@wp.func
def face_normal(t: wp.vec3i, x: wp.array[wp.vec3]) -> wp.vec3:
    return wp.normalize(wp.cross(x[t[1]] - x[t[0]], x[t[2]] - x[t[0]]))


@wp.func
def on_ridge(
    p: wp.vec3, q: wp.vec3, t1: wp.vec3i, t2: wp.vec3i, x: wp.array[wp.vec3]
) -> EdgeContact:
    """The contact of pq with the common edge of two triangles."""
    out = EdgeContact()
    ends = shared_edge(t1, t2)
    if ends[0] < 0:
        return out
    a = x[ends[0]]
    b = x[ends[1]]
    su = lines_closest(p, q, a, b)
    if wp.min(su) < 0.0 or wp.max(su) > 1.0:
        return out
    out.n = wp.normalize(wp.cross(q - p, b - a))
    if wp.dot(out.n, face_normal(t1, x) + face_normal(t2, x)) < 0.0:
        out.n = -out.n
    out.d = wp.dot(a + su[1] * (b - a) - p - su[0] * (q - p), out.n)
    out.t = su[0]
    out.vert = wp.vec3i(ends[0], ends[1], ends[1])
    out.w = wp.vec3(1.0 - su[1], su[1], 0.0)
    out.found = out.d >= 0.0
    out.ridge = True
    return out


@wp.func
def on_face(middle: wp.vec3, t: float, hit: Hit, tris: wp.array[wp.vec3i], x: wp.array[wp.vec3]):
    """The contact of the middle of a piece, at t on its edge, with its closest surface point."""
    out = EdgeContact()
    out.vert = tris[hit.tri]
    out.n = face_normal(out.vert, x)
    gap = hit_point(hit, tris, x) - middle
    if wp.dot(gap, out.n) > 0.0:
        out.n = wp.normalize(gap)
    out.d = hit.t
    out.t = t
    out.w = hit.w
    out.found = True
    return out


@wp.func
def start_gap(c: EdgeContact, i: int, j: int, x0: wp.array[wp.vec3]) -> float:
    """Gap of an edge's contact at the start of the step [m]."""
    own = x0[i] + c.t * (x0[j] - x0[i])
    other = c.w[0] * x0[c.vert[0]] + c.w[1] * x0[c.vert[1]] + c.w[2] * x0[c.vert[2]]
    return wp.dot(own - other, c.n)


@wp.func
def edge_contact(
    surface: wp.uint64,
    body: int,
    edge: float,  # mean edge of the body [m]
    fresh: bool,  # there are no overlaps from before the step
    tris: wp.array[wp.vec3i],
    x0: wp.array[wp.vec3],
    x: wp.array[wp.vec3],
    i: int,
    j: int,
) -> EdgeContact:
    """The contact of the edge from i to j with a body, if it has one."""
    p = x[i]
    q = x[j]
    reach = 0.1 * edge
    out = EdgeContact()
    crossing = first_crossing(surface, body, tris, x, p, q - p)
    enter = crossing.enter
    leave = crossing.leave
    if enter.tri >= 0 and leave.tri >= 0:
        t = 0.5 * (enter.t + leave.t)
        middle = p + t * (q - p)
        hit = closest_hit(surface, body, tris, x, middle, reach)
        contact = on_ridge(p, q, tris[enter.tri], tris[leave.tri], x)
        if contact.found and contact.d <= 2.0 * hit.t:
            if not fresh or start_gap(contact, i, j, x0) > -STALE * edge:
                return contact
            face = on_face(middle, t, hit, tris, x)
            if start_gap(face, i, j, x0) > start_gap(contact, i, j, x0):
                return face
            return contact
        if hit.tri >= 0 and hit.t > FLAT * edge:
            return on_face(middle, t, hit, tris, x)
    elif enter.tri >= 0:
        hit = closest_hit(surface, body, tris, x, q, reach)
        if hit.tri >= 0:
            out = on_ridge(p, q, tris[enter.tri], tris[hit.tri], x)
    elif leave.tri >= 0:
        hit = closest_hit(surface, body, tris, x, p, reach)
        if hit.tri >= 0:
            out = on_ridge(p, q, tris[hit.tri], tris[leave.tri], x)
    out.close = crossing.close
    return out


@wp.kernel
def count_crossings(
    # in
    edge_slots: int,  # of each edge
    fresh: bool,  # there are no overlaps from before the step
    again: bool,  # the second time in a step: only edges that were close the first time
    surface: wp.uint64,  # Bvh over the triangles, grouped by body
    tris: wp.array[wp.vec3i],  # (n_tri,)
    edges: wp.array[wp.vec4i],  # (n_edge,)
    vert_body: wp.array[int],  # (n_vert,)
    body_edge: wp.array[float],  # (n_body,) [m]
    n_near: wp.array[int],  # (n_body,)
    near: wp.array2d[int],  # (n_body, capacity)
    lower: wp.array[wp.vec3],  # (n_body,) [m]
    upper: wp.array[wp.vec3],  # (n_body,) [m]
    x0: wp.array[wp.vec3],  # (n_vert,) [m] start of the step
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # in, out
    edge_close: wp.array[int],  # (n_edge,) 1 where a triangle's box was met
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
    near_count = n_near[m]
    if again and edge_close[e] == 0:
        near_count = 0
    if near_count > 0:
        i = edges[e][0]
        j = edges[e][1]
        p = x[i]
        q = x[j]
        close = bool(False)
        for k in range(near_count):
            body = near[m, k]
            if boxes_meet(wp.min(p, q), wp.max(p, q), lower[body], upper[body]):
                edge = body_edge[body]
                contact = edge_contact(surface, body, edge, fresh, tris, x0, x, i, j)
                close = close or contact.close or contact.found
                if contact.found:
                    if n < edge_slots:
                        edge_body[e, n] = body
                    n += 1
        edge_close[e] = int(close)
    elif not again:
        edge_close[e] = 0
    if n > edge_slots:
        wp.atomic_max(needed, 0, n)
    count[e] = wp.min(n, edge_slots)


@wp.kernel
def edge_contacts(
    # in
    fresh: bool,  # there are no overlaps from before the step
    surface: wp.uint64,  # Bvh over the triangles, grouped by body
    tris: wp.array[wp.vec3i],  # (n_tri,)
    edges: wp.array[wp.vec4i],  # (n_edge,)
    vert_body: wp.array[int],  # (n_vert,)
    body_edge: wp.array[float],  # (n_body,) [m]
    hit_start: wp.array[int],  # (n_vert + 1,)
    edge_start: wp.array[int],  # (n_edge + 1,)
    edge_body: wp.array2d[int],  # (n_edge, edge_slots)
    x0: wp.array[wp.vec3],  # (n_vert,) [m] start of the step, for the weights
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
        found = edge_contact(surface, body, body_edge[body], fresh, tris, x0, x, i, j)
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
        pair[c] = wp.vec2i(vert_body[i], body)
