"""Queries on the surface of one body, through the triangle Bvh from the root of its group.

    first_hit      the first crossing of a segment that enters (or leaves) the body
    first_crossing the first crossing that enters, and the first after it that leaves
    leaving_hit    where a ray from inside leaves the body
    closest_hit    the closest point of the surface
    corner_normals outward normals of a triangle, averaged over smooth edges only

A hit is (triangle, distance along the query, weights of its corners); triangle -1 means none.
Normals averaged over the rim of a box push sideways and inject energy. Therefore a neighbouring
triangle joins the average only when it is within the crease angle.
"""

import warp as wp

from warp_contact.kernels.geometry import (
    NONE,
    PARALLEL,
    area_vector,
    segment_hit,
    triangle_closest,
)
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

OBLIQUE = wp.constant(0.1)  # cosine: a ray along a wall in which it starts does not leave by it
CREASE = wp.constant(0.6)  # cosine: edges sharper than 53 degrees keep their face normals


@wp.struct
class Hit:
    tri: int  # -1: no hit
    t: float  # along the segment [-] or the distance [m]
    w: wp.vec3  # barycentric weights


@wp.func
def weights3(h: wp.vec3) -> wp.vec3:
    """Barycentric weights of a segment hit, clamped into the triangle."""
    v = wp.clamp(h[1], 0.0, 1.0)
    w = wp.clamp(h[2], 0.0, 1.0 - v)
    return wp.vec3(1.0 - v - w, v, w)


@wp.func
def first_hit(
    surface: wp.uint64,
    root: int,
    tris: wp.array[wp.vec3i],
    x: wp.array[wp.vec3],
    p: wp.vec3,
    u: wp.vec3,
    after: float,  # only hits with t > after
    side: float,  # -1: entering (against the normal), +1: leaving
    grazing: float,  # sine to a triangle's plane up to which it is not crossed
) -> Hit:
    """First crossing of p + t u, after < t <= 1, with the body's surface on the given side."""
    best = Hit()
    best.tri = -1
    best.t = NONE
    k = int(0)
    q = p + u
    query = wp.bvh_query_aabb(surface, wp.min(p, q), wp.max(p, q), root)
    while wp.bvh_query_next(query, k):
        a = x[tris[k][0]]
        b = x[tris[k][1]]
        c = x[tris[k][2]]
        n = wp.cross(b - a, c - a)
        slope = wp.dot(u, n)
        height = wp.dot(p - a, n)
        # Crossed in the given direction, and the end is not in front of the plane.
        if side * slope > 0.0 and side * (height + slope) >= 0.0:
            h = segment_hit(p, u, a, b, c, grazing)
            if h[0] > after and h[0] <= 1.0:
                if h[0] < best.t or (h[0] == best.t and k < best.tri):
                    best.tri = k
                    best.t = h[0]
                    best.w = weights3(h)
    return best


@wp.struct
class Crossing:
    enter: Hit
    leave: Hit


@wp.func
def no_crossing() -> Crossing:
    out = Crossing()
    out.enter.tri = -1
    out.enter.t = NONE
    out.leave.tri = -1
    out.leave.t = NONE
    return out


@wp.func
def with_tri(
    found: Crossing, t: int, tris: wp.array[wp.vec3i], x: wp.array[wp.vec3], p: wp.vec3, u: wp.vec3
) -> Crossing:
    """The first crossings, with triangle t included."""
    out = found
    a = x[tris[t][0]]
    b = x[tris[t][1]]
    c = x[tris[t][2]]
    h = segment_hit(p, u, a, b, c, PARALLEL)
    if h[0] > 0.0 and h[0] <= 1.0:
        if wp.dot(u, wp.cross(b - a, c - a)) < 0.0:
            if h[0] < out.enter.t or (h[0] == out.enter.t and t < out.enter.tri):
                out.enter.tri = t
                out.enter.t = h[0]
                out.enter.w = weights3(h)
        elif h[0] < out.leave.t or (h[0] == out.leave.t and t < out.leave.tri):
            out.leave.tri = t
            out.leave.t = h[0]
            out.leave.w = weights3(h)
    return out


@wp.func
def starts_inside(found: Crossing) -> bool:
    """Whether the segment leaves before it enters: that leaving crossing is of another piece."""
    return found.enter.tri >= 0 and found.leave.tri >= 0 and found.leave.t < found.enter.t


@wp.func
def first_crossing(
    surface: wp.uint64,
    root: int,
    tris: wp.array[wp.vec3i],
    x: wp.array[wp.vec3],
    p: wp.vec3,
    u: wp.vec3,
) -> Crossing:
    """First entering crossing of p + t u, 0 < t <= 1, and the first leaving one after it."""
    out = no_crossing()
    k = int(0)
    q = p + u
    query = wp.bvh_query_aabb(surface, wp.min(p, q), wp.max(p, q), root)
    while wp.bvh_query_next(query, k):
        out = with_tri(out, k, tris, x, p, u)
    if starts_inside(out):
        out.leave = first_hit(surface, root, tris, x, p, u, out.enter.t, 1.0, PARALLEL)
    return out


@wp.func
def leaves_earlier(
    best: Hit,
    k: int,
    tris: wp.array[wp.vec3i],
    x: wp.array[wp.vec3],
    p: wp.vec3,
    r: wp.vec3,  # unit
) -> Hit:
    """The first hit where the ray p + t r, t >= 0, leaves the body, with triangle k included."""
    out = best
    a = x[tris[k][0]]
    b = x[tris[k][1]]
    c = x[tris[k][2]]
    n = wp.cross(b - a, c - a)
    if wp.dot(r, n) > OBLIQUE * wp.length(n):
        h = segment_hit(p, r, a, b, c, PARALLEL)
        if h[0] >= 0.0 and (h[0] < best.t or (h[0] == best.t and k < best.tri)):
            out.tri = k
            out.t = h[0]
            out.w = weights3(h)
    return out


@wp.func
def leaving_hit(
    surface: wp.uint64,
    root: int,
    tris: wp.array[wp.vec3i],
    x: wp.array[wp.vec3],
    p: wp.vec3,
    r: wp.vec3,  # unit
) -> Hit:
    """Where the ray p + t r, t >= 0, first leaves the body."""
    best = Hit()
    best.tri = -1
    best.t = NONE
    k = int(0)
    query = wp.bvh_query_ray(surface, p, r, root)
    while wp.bvh_query_next(query, k, best.t):
        best = leaves_earlier(best, k, tris, x, p, r)
    return best


@wp.func
def closer(best: Hit, t: int, tris: wp.array[wp.vec3i], x: wp.array[wp.vec3], p: wp.vec3) -> Hit:
    """The closest point to p, with triangle t included."""
    out = best
    a = x[tris[t][0]]
    b = x[tris[t][1]]
    c = x[tris[t][2]]
    w = triangle_closest(p, a, b, c)
    d = wp.length(w[0] * (a - p) + w[1] * (b - p) + w[2] * (c - p))
    if d < out.t or (d == out.t and t < out.tri):
        out.tri = t
        out.t = d
        out.w = w
    return out


@wp.func
def closest_hit(
    surface: wp.uint64,
    root: int,
    tris: wp.array[wp.vec3i],
    x: wp.array[wp.vec3],
    p: wp.vec3,
    reach: float,  # radius of the first query; doubled until it suffices [m]
) -> Hit:
    """Closest point of the body's surface; none only if it is a million reaches away."""
    best = Hit()
    best.tri = -1
    best.t = NONE
    k = int(0)
    radius = float(reach)
    for _attempt in range(20):
        grow = wp.vec3(radius, radius, radius)
        query = wp.bvh_query_aabb(surface, p - grow, p + grow, root)
        while wp.bvh_query_next(query, k):
            best = closer(best, k, tris, x, p)
        if best.t <= radius:
            return best
        radius = 2.0 * radius
    return best


@wp.func
def corner_normal(
    i: int,
    face: wp.vec3,  # area vector of the triangle itself [m^2]
    tris: wp.array[wp.vec3i],
    vs_start: wp.array[int],
    vs_tri: wp.array[int],
    x: wp.array[wp.vec3],
) -> wp.vec3:
    """Unit normal at vertex i over the triangles within the crease angle of the face."""
    n = wp.vec3(0.0, 0.0, 0.0)
    f = wp.normalize(face)
    for e in range(vs_start[i], vs_start[i + 1]):
        t = tris[vs_tri[e]]
        s = area_vector(x[t[0]], x[t[1]], x[t[2]])
        if wp.dot(s, f) > CREASE * wp.length(s):
            n += s
    return wp.normalize(n)


@wp.func
def corner_normals(
    t: wp.vec3i,
    tris: wp.array[wp.vec3i],
    vs_start: wp.array[int],
    vs_tri: wp.array[int],
    x: wp.array[wp.vec3],
) -> wp.mat33:
    """Outward unit normals at the corners of a triangle, as columns.

    The normal at a hit is their sum by its weights, normalised.
    """
    face = area_vector(x[t[0]], x[t[1]], x[t[2]])
    return wp.matrix_from_cols(
        corner_normal(t[0], face, tris, vs_start, vs_tri, x),
        corner_normal(t[1], face, tris, vs_start, vs_tri, x),
        corner_normal(t[2], face, tris, vs_start, vs_tri, x),
    )


@wp.func
def face_normal(t: wp.vec3i, x: wp.array[wp.vec3]) -> wp.vec3:
    return wp.normalize(wp.cross(x[t[1]] - x[t[0]], x[t[2]] - x[t[0]]))


@wp.func
def hit_point(hit: Hit, tris: wp.array[wp.vec3i], x: wp.array[wp.vec3]) -> wp.vec3:
    t = tris[hit.tri]
    return hit.w[0] * x[t[0]] + hit.w[1] * x[t[1]] + hit.w[2] * x[t[2]]


@wp.func
def inner_side(hit: Hit, tris: wp.array[wp.vec3i], x: wp.array[wp.vec3], p: wp.vec3) -> float:
    """How deep p lies behind the face of its closest point [m]; negative in front of it."""
    if hit.tri < 0:
        return 0.0
    return wp.dot(hit_point(hit, tris, x) - p, face_normal(tris[hit.tri], x))
