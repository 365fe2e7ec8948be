"""Stage 1, in every step: which candidates are hits, a vertex inside a body or below a plane.

A vertex in the skin of a body, SKIN of an edge, is a hit too. Rims that lie flush in a wall would
else be inside or outside by rounding, and a contact at rest would be lost and found in turns.

Hits keep the order of their candidates: by vertex, then by body, planes last.
"""

import warp as wp

from warp_contact.kernels.broad_phase.margins import CAREFUL
from warp_contact.kernels.geometry import NONE, tet_weights, triangle_closest
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

SKIN = wp.constant(1.0e-3)  # of an edge: a vertex this close is looked at like one inside


@wp.func
def distance(x: wp.vec3, a: wp.vec3, b: wp.vec3, c: wp.vec3, d: wp.vec3) -> float:
    """A distance [m] that x keeps from the planes of a tet's faces, 0 from one that is inverted."""
    n1 = wp.cross(b - a, d - a)
    n2 = wp.cross(d - a, c - a)
    n3 = wp.cross(c - a, b - a)
    n4 = wp.cross(c - b, d - b)
    out = wp.max(
        wp.max(wp.dot(n1, x - a) / wp.length(n1), wp.dot(n2, x - a) / wp.length(n2)),
        wp.max(wp.dot(n3, x - a) / wp.length(n3), wp.dot(n4, x - b) / wp.length(n4)),
    )
    if out > 0.0 and wp.dot(n4, a - b) < 0.0:
        return out
    return 0.0


@wp.func
def distance_to(x: wp.vec3, a: wp.vec3, b: wp.vec3, c: wp.vec3) -> float:
    w = triangle_closest(x, a, b, c)
    return wp.length(w[0] * (a - x) + w[1] * (b - x) + w[2] * (c - x))


@wp.func
def distance_to_faces(x: wp.vec3, a: wp.vec3, b: wp.vec3, c: wp.vec3, d: wp.vec3) -> float:
    """Distance to the surface of a tet [m]."""
    return wp.min(
        wp.min(distance_to(x, a, b, c), distance_to(x, a, b, d)),
        wp.min(distance_to(x, a, c, d), distance_to(x, b, c, d)),
    )


@wp.func
def clearance(
    x: wp.vec3,
    skin: float,  # [m]
    among: wp.vec2i,
    tet: wp.array[int],
    tets: wp.array[wp.vec4i],
    y: wp.array[wp.vec3],
) -> float:
    """A distance [m] that x keeps from the skins of all tets, not above 0 where it is in one."""
    out = float(NONE)
    for k in range(among[0], among[1]):
        t = tets[tet[k]]
        if wp.min(tet_weights(x, y[t[0]], y[t[1]], y[t[2]], y[t[3]])) >= 0.0:
            return 0.0
        apart = distance(x, y[t[0]], y[t[1]], y[t[2]], y[t[3]]) - skin
        if apart < 0.0:
            apart = distance_to_faces(x, y[t[0]], y[t[1]], y[t[2]], y[t[3]]) - skin
            if apart <= 0.0:
                return 0.0
        out = wp.min(out, apart)
    return out


@wp.kernel
def find_hits(
    # in
    threads: int,
    n_pair: wp.array[int],  # (1,)
    pair: wp.array[wp.vec2i],  # (capacity,) vertex and body, n_body + p for plane p
    pair_tets: wp.array[wp.vec2i],  # (capacity,) first and end in ``tet``
    tet: wp.array[int],  # (capacity,)
    n_body: int,
    tets: wp.array[wp.vec4i],  # (n_tet,)
    vert_body: wp.array[int],  # (n_vert,)
    body_edge: wp.array[float],  # (n_body,) [m]
    plane_n: wp.array[wp.vec3],  # (n_plane,)
    plane_h: wp.array[float],  # (n_plane,) [m]
    way: wp.array[float],  # (n_body + n_plane,) [m]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # in, out
    wake: wp.array[float],  # (capacity,) [m] way of both bodies until which there is no hit
    # out
    hit: wp.array[int],  # (capacity + 1,) 1 for a hit, 0 for all others
):
    """For each candidate, and for the room behind them."""
    for c in range(wp.tid(), hit.shape[0], threads):
        hit[c] = 0
        if c >= n_pair[0]:
            continue
        i = pair[c][0]
        body = pair[c][1]
        spent = way[vert_body[i]] + way[body]
        if spent < wake[c]:
            continue
        wake[c] = -1.0
        clear = float(0.0)
        inside = bool(False)
        if body >= n_body:
            clear = wp.dot(plane_n[body - n_body], x[i]) - plane_h[body - n_body]
            inside = clear < 0.0
        else:
            clear = clearance(x[i], SKIN * body_edge[body], pair_tets[c], tet, tets, x)
            inside = clear <= 0.0
        if inside:
            hit[c] = 1
        else:
            wake[c] = spent + CAREFUL * clear


@wp.kernel
def list_hits(
    # in
    threads: int,
    n_body: int,
    n_pair: wp.array[int],  # (1,)
    pair: wp.array[wp.vec2i],  # (capacity,)
    hit_at: wp.array[int],  # (capacity + 1,) hits before each candidate
    # out
    hit_vert: wp.array[int],  # (contacts,)
    hit_body: wp.array[int],  # (contacts,) n_body + p for plane p
    hit_layer: wp.array[int],  # (contacts,) -1: no depth yet
    layer: wp.array[int],  # (1,) 0
    pending: wp.array[int],  # (1,) 0
):
    """For each candidate; the first thread sets what their depths begin with."""
    if wp.tid() == 0:
        layer[0] = 0
        pending[0] = 0
    for c in range(wp.tid(), n_pair[0], threads):
        e = hit_at[c]
        if hit_at[c + 1] == e or e >= hit_vert.shape[0]:
            continue
        hit_vert[e] = pair[c][0]
        hit_body[e] = pair[c][1]
        hit_layer[e] = -1
        if pair[c][1] >= n_body:
            hit_layer[e] = 0


@wp.func
def hit_range(i: int, pair_start: wp.array[int], hit_at: wp.array[int], room: int) -> wp.vec2i:
    """First and end of the hits of vertex i; none where the candidates did not fit."""
    last = hit_at.shape[0] - 1
    return wp.vec2i(
        wp.min(hit_at[wp.min(pair_start[i], last)], room),
        wp.min(hit_at[wp.min(pair_start[i + 1], last)], room),
    )


@wp.func
def is_hit(
    i: int, body: int, pair_start: wp.array[int], hit_at: wp.array[int], hit_body: wp.array[int]
) -> bool:
    """Whether vertex i is inside the body."""
    around = hit_range(i, pair_start, hit_at, hit_body.shape[0])
    for e in range(around[0], around[1]):
        if hit_body[e] == body:
            return True
    return False
