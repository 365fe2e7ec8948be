"""Stage 3, narrow phase: the penetrations of a step, vertices inside a body or below a plane.

A vertex that went through a body within the step, in by one side and out by another, counts too: by
a swept test, where the motion in the step is long against the thickness of the body.

A vertex outside but within the speculative margin of a body, VERTEX_MARGIN of an edge, counts too.
Otherwise rounding would decide whether a rim that lies flush in a wall is inside, and a resting
contact would be lost and found again and again.

Penetrations keep the order of their pairs: by vertex, then by body, planes last.
"""

import warp as wp

from warp_contact.kernels.broad_phase.pairs import PairList
from warp_contact.kernels.broad_phase.skins import CAREFUL
from warp_contact.kernels.geometry import NONE, tet_weights, triangle_closest
from warp_contact.kernels.lengths import STALE_OVERLAP, VERTEX_MARGIN
from warp_contact.kernels.mesh import Mesh
from warp_contact.kernels.narrow_phase.surface_query import (
    Hit,
    closest_hit,
    face_normal,
    hit_point,
    leaving_hit,
)
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

INSIDE = wp.constant(-1.0)  # in place of a distance until a vertex may penetrate
THROUGH = wp.constant(-2.0)  # the same, of one that went through the body
SWEPT = wp.constant(0.5)  # of the thickness of a body: a longer motion in a step may go through it

# Where a vertex lies against the triangles of the body next to it.
UNSURE = wp.constant(0)
ABOVE = wp.constant(1)
BELOW = wp.constant(2)
BEYOND = wp.constant(3)  # it went through the body


@wp.func
def distance(x: wp.vec3, a: wp.vec3, b: wp.vec3, c: wp.vec3, d: wp.vec3) -> float:
    """Distance [m] of x to a tet by the planes of its faces, or less; 0 for an inverted one."""
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
    margin: float,  # [m]
    among: wp.vec2i,
    tet: wp.array[int],
    tets: wp.array[wp.vec4i],
    y: wp.array[wp.vec3],
) -> float:
    """Lower bound [m] on the distance of x to the margins of all tets; 0 if it is in one."""
    out = float(NONE)
    for k in range(among[0], among[1]):
        t = tets[tet[k]]
        if wp.min(tet_weights(x, y[t[0]], y[t[1]], y[t[2]], y[t[3]])) >= 0.0:
            return 0.0
        apart = distance(x, y[t[0]], y[t[1]], y[t[2]], y[t[3]]) - margin
        if apart < 0.0:
            apart = distance_to_faces(x, y[t[0]], y[t[1]], y[t[2]], y[t[3]]) - margin
            if apart <= 0.0:
                return 0.0
        out = wp.min(out, apart)
    return out


@wp.struct
class Entry:
    """Where a vertex came into a body within a step."""

    hit: Hit  # the triangle, and the distance back to it [m]
    back: float  # way of the vertex against the body [m]
    start: float  # gap to the triangle when the step began [m]


@wp.func
def entry_of(
    near: Hit,  # the closest point of the body
    surface: wp.uint64,
    root: int,
    tris: wp.array[wp.vec3i],
    x0: wp.array[wp.vec3],
    x: wp.array[wp.vec3],
    i: int,
) -> Entry:
    """The triangle by which vertex i came in on a straight way against the closest point."""
    out = Entry()
    out.hit.tri = -1
    back = x0[i] - hit_point(near, tris, x0) - (x[i] - hit_point(near, tris, x))
    out.back = wp.length(back)
    if out.back > 0.0:
        out.hit = leaving_hit(surface, root, tris, x, x[i], back / out.back)
        if out.hit.tri >= 0:
            n = face_normal(tris[out.hit.tri], x)
            out.start = wp.dot(x0[i] - hit_point(out.hit, tris, x0), n)
    return out


@wp.func
def went_through(
    i: int, body: int, clear: float, mesh: Mesh, x0: wp.array[wp.vec3], x: wp.array[wp.vec3]
) -> bool:
    """Whether a vertex that is outside a body, this far from it, went through it in the step."""
    root = wp.bvh_get_group_root(mesh.bvh, body)
    edge = mesh.body_edge[body]
    near = closest_hit(mesh.bvh, root, mesh.tris, x, x[i], clear + 0.1 * edge)
    if near.tri < 0:
        return False
    entry = entry_of(near, mesh.bvh, root, mesh.tris, x0, x, i)
    if entry.hit.tri < 0 or entry.hit.t > entry.back:
        return False
    return entry.start >= -STALE_OVERLAP * edge


@wp.struct
class Penetration:
    """A vertex inside a body, or one that went through it; depth.py finds its depth."""

    vert: int
    body: int  # n_body + p for plane p
    pair: int  # of the broad phase
    layer: int  # of the propagation, -1: no depth yet
    depth: float  # [m]
    direction: wp.vec3  # out of the body
    side: int  # of the triangles next to it: UNSURE, ABOVE or BELOW of shallow.py; or BEYOND
    hit: Hit  # BELOW where its direction leaves the body, ABOVE the closest point that it opposes


@wp.kernel
def find_penetrations(
    # in
    threads: int,
    mesh: Mesh,
    pairs: PairList,  # vertices and bodies
    travelled: wp.array[float],  # (n_body + n_plane,) [m]
    near_plane: float,  # [edge] a vertex this close above one counts too
    thickness: wp.array[float],  # (n_body,) [m]
    x0: wp.array[wp.vec3],  # (n_vert,) start of the step [m]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # in, out
    clear_until: wp.array[float],  # (capacity,) [m] travelled by both, before any penetration
    # out
    is_inside: wp.array[int],  # (capacity + 1,) 1 for a penetration, 0 for all others
):
    """For each pair: whether its vertex penetrates; 0 for the unused capacity."""
    for c in range(wp.tid(), is_inside.shape[0], threads):
        is_inside[c] = 0
        if c >= pairs.n[0]:
            continue
        i = pairs.pair[c][0]
        body = pairs.pair[c][1]
        spent = travelled[mesh.vert_body[i]] + travelled[body]
        near = near_plane * mesh.body_edge[mesh.vert_body[i]]
        if spent + near < clear_until[c]:
            continue
        clear_until[c] = INSIDE
        clear = float(0.0)
        inside = bool(False)
        if body >= mesh.n_body:
            p = body - mesh.n_body
            clear = wp.dot(mesh.plane_n[p], x[i]) - mesh.plane_h[p]
            inside = clear < near
        else:
            margin = VERTEX_MARGIN * mesh.body_edge[body]
            clear = clearance(x[i], margin, pairs.items[c], pairs.item, mesh.tets, x)
            inside = clear <= 0.0
            if not inside:
                t = mesh.tets[pairs.item[pairs.items[c][0]]]
                way = wp.length(x[i] - x0[i] - (x[t[0]] - x0[t[0]]))
                if way > wp.max(SWEPT * thickness[body], clear):
                    if went_through(i, body, clear, mesh, x0, x):
                        inside = True
                        clear_until[c] = THROUGH
        if inside:
            is_inside[c] = 1
        else:
            clear_until[c] = spent + CAREFUL * clear


@wp.kernel
def list_penetrations(
    # in
    threads: int,
    n_body: int,
    pairs: PairList,  # vertices and bodies
    inside_at: wp.array[int],  # (capacity + 1,) penetrations before each pair
    clear_until: wp.array[float],  # (capacity,) THROUGH where a vertex went through
    # out
    penetration: wp.array[Penetration],  # (contacts,)
    layer: wp.array[int],  # (1,) 0
    pending: wp.array[int],  # (1,) 0
):
    """For each pair: list its penetration. The first thread resets the layers of depth."""
    if wp.tid() == 0:
        layer[0] = 0
        pending[0] = 0
    for c in range(wp.tid(), pairs.n[0], threads):
        e = inside_at[c]
        if inside_at[c + 1] == e or e >= penetration.shape[0]:
            continue
        found = Penetration()
        found.vert = pairs.pair[c][0]
        found.body = pairs.pair[c][1]
        found.pair = c
        found.layer = wp.where(found.body >= n_body, 0, -1)
        found.hit.tri = -1
        if clear_until[c] == THROUGH:
            found.side = BEYOND
        penetration[e] = found


@wp.func
def penetrations_of(
    i: int, start: wp.array[int], inside_at: wp.array[int], capacity: int
) -> wp.vec2i:
    """First and end of the penetrations of vertex i; none where the pairs did not fit."""
    last = inside_at.shape[0] - 1
    return wp.vec2i(
        wp.min(inside_at[wp.min(start[i], last)], capacity),
        wp.min(inside_at[wp.min(start[i + 1], last)], capacity),
    )


@wp.func
def is_inside_of(
    i: int,
    body: int,
    start: wp.array[int],
    inside_at: wp.array[int],
    penetration: wp.array[Penetration],
) -> bool:
    """Whether vertex i is inside the body."""
    around = penetrations_of(i, start, inside_at, penetration.shape[0])
    for e in range(around[0], around[1]):
        if penetration[e].body == body:
            return True
    return False
