"""The contact of a surface edge with a body that it crosses.

The paper leaves out edge against edge, but its scenes need it. An edge pq enters N through the
triangle t1 and leaves by t2.

    ridge     t1 and t2 share an edge ab: n = +-(pq x ab), on the side of n1 + n2. The contact joins
              the closest points of pq and ab; both must lie inside their segments
    face      otherwise: n leads from the middle of the inner piece of pq to the closest surface
              point. The contact lies at the mean of the ends of the piece, weighted by their
              depths along n: at the deep end if the other one lies in the face

The face also replaces a ridge that is more than twice as far from pq as the middle is from the
surface: otherwise an edge flush in a face would be pushed out sideways through other faces. In a
sharp wedge the middle is closer anyway, by sin(half the dihedral angle), which the test allows for.
And the face replaces a ridge that would have overlapped more than it at the start of the step, if
bodies were apart then: the lines have passed each other.

With one end inside, the triangle closest to that end stands for t2, or t1. Only a ridge makes a
contact then: the vertex has one of its own, but where two rims cross that lies beside the overlap.
The ridge is dropped if it would have overlapped before: the edge touches a corner from the side.

In any case a contact must push against a face of its edge (opposing.py).
"""

import warp as wp

from warp_contact.kernels.geometry import NONE, lines_closest, projected_weights
from warp_contact.kernels.lengths import FLUSH_EDGE, STALE_OVERLAP
from warp_contact.kernels.narrow_phase.opposing import edge_looks, opposes
from warp_contact.kernels.narrow_phase.surface_query import (
    Crossing,
    Hit,
    closer,
    closest_hit,
    face_normal,
    hit_point,
    inner_side,
    no_crossing,
    starts_inside,
    with_tri,
)
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

# Of both skins: a closer triangle is taken to be among those of the pair. Just before pairs are
# found again this may fail, for edges deeper than 0.02 of their length.
SURE = wp.constant(0.125)
SHARP = wp.constant(1.64)  # a ridge with a dihedral angle below 75 degrees is sharp
TURNED = wp.constant(0.95)  # cosine: the normal of two almost parallel edges turns in a step
ASIDE = wp.constant(1.0)  # weights: how far from the closest point a contact with a face may lie


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
    t: float  # parameter along pq
    n: wp.vec3
    d: float  # [m]
    vert: wp.vec3i  # of N
    w: wp.vec3  # their weights
    ridge: bool
    half: float  # sine of half the dihedral angle of the ridge
    edge: int  # pq itself
    body: int  # N
    next: int  # place of another contact of this edge and N, -1 for none
    kept: wp.vec4  # [N s], [N] in implicit steps: tangential and normal impulse so far


@wp.func
def is_same(a: EdgeContact, b: EdgeContact) -> bool:
    """Whether two contacts of an edge with a body touch the same part of it, on the same side."""
    if a.ridge != b.ridge or wp.dot(a.n, b.n) < TURNED:
        return False
    if a.ridge and a.vert[0] == b.vert[1]:
        return a.vert[1] == b.vert[0]
    return a.vert == b.vert


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
    n1 = face_normal(t1, x)
    n2 = face_normal(t2, x)
    if wp.dot(out.n, n1 + n2) < 0.0:
        out.n = -out.n
    out.half = 0.5 * wp.length(n1 + n2)
    out.d = wp.dot(a + su[1] * (b - a) - p - su[0] * (q - p), out.n)
    out.t = su[0]
    out.vert = wp.vec3i(ends[0], ends[1], ends[1])
    out.w = wp.vec3(1.0 - su[1], su[1], 0.0)
    out.found = out.d >= 0.0
    out.ridge = True
    return out


@wp.func
def on_face(
    p: wp.vec3,
    q: wp.vec3,
    first: float,
    last: float,
    hit: Hit,
    tris: wp.array[wp.vec3i],
    x: wp.array[wp.vec3],
) -> EdgeContact:
    """The contact of a piece of pq, from first to last, with the point closest to its middle."""
    out = EdgeContact()
    out.vert = tris[hit.tri]
    out.n = face_normal(out.vert, x)
    point = hit_point(hit, tris, x)
    out.t = 0.5 * (first + last)
    gap = point - p - out.t * (q - p)
    if wp.dot(gap, out.n) > 0.0:
        out.n = wp.normalize(gap)
    out.d = hit.t
    out.w = hit.w
    out.found = True
    a = wp.max(wp.dot(point - p - first * (q - p), out.n), 0.0)
    b = wp.max(wp.dot(point - p - last * (q - p), out.n), 0.0)
    if a + b > 0.0:
        t = (a * first + b * last) / (a + b)
        own = p + t * (q - p)
        w = projected_weights(own, out.n, x[out.vert[0]], x[out.vert[1]], x[out.vert[2]])
        if wp.length(w - hit.w) < ASIDE:
            out.t = t
            out.d = wp.dot(point - own, out.n)
            out.w = w
    return out


@wp.func
def start_gap(c: EdgeContact, i: int, j: int, x0: wp.array[wp.vec3]) -> float:
    """Gap of an edge's contact at the start of the step [m]."""
    own = x0[i] + c.t * (x0[j] - x0[i])
    other = c.w[0] * x0[c.vert[0]] + c.w[1] * x0[c.vert[1]] + c.w[2] * x0[c.vert[2]]
    return wp.dot(own - other, c.n)


@wp.func
def crossing_of(
    among: wp.vec2i,  # first and end of the triangles to test
    tri: wp.array[int],
    tris: wp.array[wp.vec3i],
    x: wp.array[wp.vec3],
    p: wp.vec3,
    q: wp.vec3,
) -> Crossing:
    """First entering crossing of pq and the first leaving one after it."""
    out = no_crossing()
    for k in range(among[0], among[1]):
        out = with_tri(out, tri[k], tris, x, p, q - p)
    if starts_inside(out):
        rest = no_crossing()
        start = out.enter.t
        inner = p + start * (q - p)
        for k in range(among[0], among[1]):
            if tri[k] != out.enter.tri:
                rest = with_tri(rest, tri[k], tris, x, inner, q - inner)
        out.leave = rest.leave
        out.leave.t = start + (1.0 - start) * rest.leave.t
    return out


@wp.func
def closest_of(
    surface: wp.uint64,
    body: int,
    sure: float,  # a point closer than this is on one of the triangles [m]
    reach: float,  # radius of the first query of the whole surface [m]
    among: wp.vec2i,
    tri: wp.array[int],
    tris: wp.array[wp.vec3i],
    x: wp.array[wp.vec3],
    p: wp.vec3,
) -> Hit:
    """Closest point of the body's surface."""
    best = Hit()
    best.tri = -1
    best.t = NONE
    for k in range(among[0], among[1]):
        best = closer(best, tri[k], tris, x, p)
    if best.t <= sure:
        return best
    root = wp.bvh_get_group_root(surface, body)
    return closest_hit(surface, root, tris, x, p, reach)


@wp.func
def crossing_contact(
    surface: wp.uint64,
    body: int,
    edge: float,  # mean edge of the body [m]
    apart: bool,  # bodies did not overlap when the step began
    reach: float,  # of the pairs: both skins [m]
    among: wp.vec2i,  # first and end of its triangles that the edge may cross
    tri: wp.array[int],
    tris: wp.array[wp.vec3i],
    x0: wp.array[wp.vec3],
    x: wp.array[wp.vec3],
    i: int,
    j: int,
) -> EdgeContact:
    """The contact of the edge from i to j with a body, if it has one."""
    p = x[i]
    q = x[j]
    sure = SURE * reach
    out = EdgeContact()
    crossing = crossing_of(among, tri, tris, x, p, q)
    enter = crossing.enter
    leave = crossing.leave
    if enter.tri >= 0 and leave.tri >= 0:
        t = 0.5 * (enter.t + leave.t)
        middle = p + t * (q - p)
        hit = closest_of(surface, body, sure, 0.1 * edge, among, tri, tris, x, middle)
        if inner_side(hit, tris, x, middle) <= 0.0:
            return out  # the line only grazes a rim
        contact = on_ridge(p, q, tris[enter.tri], tris[leave.tri], x)
        if contact.found and wp.min(SHARP * contact.half, 1.0) * contact.d <= 2.0 * hit.t:
            if not apart or start_gap(contact, i, j, x0) > -STALE_OVERLAP * edge:
                return contact
            face = on_face(p, q, enter.t, leave.t, hit, tris, x)
            if start_gap(face, i, j, x0) > start_gap(contact, i, j, x0):
                return face
            return contact
        if hit.t > FLUSH_EDGE * edge:
            return on_face(p, q, enter.t, leave.t, hit, tris, x)
    elif enter.tri >= 0:
        hit = closest_of(surface, body, sure, 0.1 * edge, among, tri, tris, x, q)
        if hit.tri >= 0:
            out = on_ridge(p, q, tris[enter.tri], tris[hit.tri], x)
    elif leave.tri >= 0:
        hit = closest_of(surface, body, sure, 0.1 * edge, among, tri, tris, x, p)
        if hit.tri >= 0:
            out = on_ridge(p, q, tris[hit.tri], tris[leave.tri], x)
    if apart and out.found and start_gap(out, i, j, x0) < -STALE_OVERLAP * edge:
        out.found = False
    return out


@wp.func
def edge_contact(
    surface: wp.uint64,
    body: int,
    edge: float,  # mean edge of the body [m]
    apart: bool,  # bodies did not overlap when the step began
    reach: float,  # of the pairs: both skins [m]
    among: wp.vec2i,  # first and end of its triangles that the edge may cross
    tri: wp.array[int],
    tris: wp.array[wp.vec3i],
    x0: wp.array[wp.vec3],
    x: wp.array[wp.vec3],
    e: wp.vec4i,
) -> EdgeContact:
    """The contact of an edge with a body, if it has one."""
    out = crossing_contact(surface, body, edge, apart, reach, among, tri, tris, x0, x, e[0], e[1])
    if out.found and not opposes(edge_looks(tris[e[2]], tris[e[3]], out.n, x)):
        out.found = False
    return out
