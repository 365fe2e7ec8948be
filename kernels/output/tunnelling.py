"""What went through a surface between two looks at the scene.

A point goes from p0 to p1 while a triangle goes from (a0, b0, c0) to (a1, b1, c1), all of them
straight and at constant speed. With u = p - a, v = b - a, w = c - a [m] the point is in the plane
of the triangle where

    f(s) = u(s) . (v(s) x w(s)) = 0,   0 <= s <= 1      [m^3], a cubic (Provot 1997)

It goes in where f falls and out where f rises. What goes in by a face and out by one that looks the
other way went through; out by the same face, or round a corner, it did not. It has to be deeper
than ``SKIN`` of the body's thickness on its way: a vertex that grazes a base from rim to rim does
not go through the body.
"""

import warp as wp

from warp_contact.kernels.broad_phase.bounds import GROW, next_in
from warp_contact.kernels.geometry import GROWN, NONE, triangle_closest
from warp_contact.kernels.narrow_phase.surface_query import face_normal
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

OPPOSED = wp.constant(-0.5)  # cosine between two faces that look away from each other
SKIN = wp.constant(0.1)  # of the thickness of a body
HALVINGS = wp.constant(24)  # of an interval, down to the rounding of its end


@wp.struct
class Relative:
    """Point, second and third corner against the first corner, at s = 0 and s = 1 [m]."""

    u0: wp.vec3
    u1: wp.vec3
    v0: wp.vec3
    v1: wp.vec3
    w0: wp.vec3
    w1: wp.vec3


@wp.struct
class Trip:
    """Times and triangles of the first way in, the last way in and the last way out; -1: none."""

    came: float
    came_tri: int
    back: float
    back_tri: int
    left: float
    left_tri: int


@wp.func
def between(a: wp.vec3, b: wp.vec3, s: float) -> wp.vec3:
    return (1.0 - s) * a + s * b  # exact at both ends: the next look starts where this one ended


@wp.func
def height(r: Relative, s: float) -> float:
    """f(s): above zero outside [m^3]."""
    n = wp.cross(between(r.v0, r.v1, s), between(r.w0, r.w1, s))
    return wp.dot(between(r.u0, r.u1, s), n)


@wp.func
def turning(r: Relative) -> wp.vec2:
    """Where f turns, in ascending order; 0 or 1 for what is not within (0, 1)."""
    du = r.u1 - r.u0
    dv = r.v1 - r.v0
    dw = r.w1 - r.w0
    n0 = wp.cross(r.v0, r.w0)
    n1 = wp.cross(dv, r.w0) + wp.cross(r.v0, dw)
    n2 = wp.cross(dv, dw)
    c = wp.dot(du, n0) + wp.dot(r.u0, n1)  # f' = a s^2 + b s + c
    b = 2.0 * (wp.dot(r.u0, n2) + wp.dot(du, n1))
    a = 3.0 * wp.dot(du, n2)
    d = b * b - 4.0 * a * c
    if d <= 0.0:
        return wp.vec2(0.0, 1.0)
    q = -0.5 * (b + wp.sqrt(d))
    if b < 0.0:
        q = -0.5 * (b - wp.sqrt(d))
    first = float(1.0)
    if wp.abs(q) < wp.abs(a):
        first = wp.clamp(q / a, 0.0, 1.0)
    second = float(1.0)
    if wp.abs(c) < wp.abs(q):
        second = wp.clamp(c / q, 0.0, 1.0)
    return wp.vec2(wp.min(first, second), wp.max(first, second))


@wp.func
def within(r: Relative, s: float) -> bool:
    """Whether the point's foot is in the triangle."""
    u = between(r.u0, r.u1, s)
    v = between(r.v0, r.v1, s)
    w = between(r.w0, r.w1, s)
    n = wp.cross(v, w)
    area2 = wp.dot(n, n)
    b = wp.dot(wp.cross(u, w), n)
    c = wp.dot(wp.cross(v, u), n)
    least = -GROWN * area2
    return area2 > 0.0 and b >= least and c >= least and area2 - b - c >= least


@wp.func
def crossing_time(r: Relative, low: float, high: float) -> float:
    """When the point crosses the triangle while f rises or falls; NONE if it does not."""
    outside = height(r, low) >= 0.0
    if outside == (height(r, high) >= 0.0):
        return NONE
    lo = float(low)
    hi = float(high)
    for _halving in range(HALVINGS):
        mid = 0.5 * (lo + hi)
        if (height(r, mid) >= 0.0) == outside:
            lo = mid
        else:
            hi = mid
    if within(r, hi):
        return hi
    return NONE


@wp.func
def no_trip() -> Trip:
    out = Trip()
    out.came = NONE
    out.came_tri = -1
    out.back = -1.0
    out.back_tri = -1
    out.left = -1.0
    out.left_tri = -1
    return out


@wp.func
def with_time(trip: Trip, t: int, s: float, inward: bool) -> Trip:
    """The trip with one more crossing, of triangle t."""
    out = trip
    if inward:
        if s < out.came:
            out.came = s
            out.came_tri = t
        if s > out.back:
            out.back = s
            out.back_tri = t
    elif s > out.left:
        out.left = s
        out.left_tri = t
    return out


@wp.func
def trip_through(
    surface: wp.uint64,
    body: int,
    tris: wp.array[wp.vec3i],
    x0: wp.array[wp.vec3],
    x1: wp.array[wp.vec3],
    p0: wp.vec3,
    p1: wp.vec3,
) -> Trip:
    """What a point does at the surface of a body on its way from p0 to p1."""
    trip = no_trip()
    t = int(0)
    root = wp.bvh_get_group_root(surface, body)
    query = wp.bvh_query_aabb(surface, wp.min(p0, p1), wp.max(p0, p1), root)
    while wp.bvh_query_next(query, t):
        a = tris[t][0]
        b = tris[t][1]
        c = tris[t][2]
        r = Relative()
        r.u0 = p0 - x0[a]
        r.u1 = p1 - x1[a]
        r.v0 = x0[b] - x0[a]
        r.v1 = x1[b] - x1[a]
        r.w0 = x0[c] - x0[a]
        r.w1 = x1[c] - x1[a]
        turn = turning(r)
        low = float(0.0)
        for k in range(3):
            high = float(1.0)
            if k < 2:
                high = turn[k]
            s = crossing_time(r, low, high)
            if s < NONE:
                trip = with_time(trip, t, s, height(r, low) >= 0.0)
            low = high
    return trip


@wp.func
def is_deep(
    surface: wp.uint64,
    body: int,
    tris: wp.array[wp.vec3i],
    x0: wp.array[wp.vec3],
    x1: wp.array[wp.vec3],
    p: wp.vec3,
    s: float,
    skin: float,  # [m]
) -> bool:
    """Whether no triangle of the body is as close to p at s as the skin."""
    deep = bool(True)
    t = int(0)
    grow = wp.vec3(skin, skin, skin)
    root = wp.bvh_get_group_root(surface, body)
    query = wp.bvh_query_aabb(surface, p - grow, p + grow, root)
    while wp.bvh_query_next(query, t):
        a = between(x0[tris[t][0]], x1[tris[t][0]], s)
        b = between(x0[tris[t][1]], x1[tris[t][1]], s)
        c = between(x0[tris[t][2]], x1[tris[t][2]], s)
        w = triangle_closest(p, a, b, c)
        if wp.length(w[0] * (a - p) + w[1] * (b - p) + w[2] * (c - p)) < skin:
            deep = False
    return deep


@wp.func
def opposed(came_tri: int, left_tri: int, tris: wp.array[wp.vec3i], x: wp.array[wp.vec3]) -> bool:
    return wp.dot(face_normal(tris[came_tri], x), face_normal(tris[left_tri], x)) < OPPOSED


@wp.kernel
def triangle_paths(
    # in
    tris: wp.array[wp.vec3i],  # (n_tri,)
    tri_body: wp.array[int],  # (n_tri,)
    body_edge: wp.array[float],  # (n_body,) [m]
    x0: wp.array[wp.vec3],  # (n_vert,) [m]
    x1: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    lower: wp.array[wp.vec3],  # (n_tri,) [m]
    upper: wp.array[wp.vec3],  # (n_tri,) [m]
):
    """One thread per triangle: the box of its way."""
    k = wp.tid()
    t = tris[k]
    g = GROW * body_edge[tri_body[k]]
    lo = wp.min(x0[t[0]], x1[t[0]])
    hi = wp.max(x0[t[0]], x1[t[0]])
    for c in range(1, 3):
        lo = wp.min(lo, wp.min(x0[t[c]], x1[t[c]]))
        hi = wp.max(hi, wp.max(x0[t[c]], x1[t[c]]))
    lower[k] = lo - wp.vec3(g, g, g)
    upper[k] = hi + wp.vec3(g, g, g)


@wp.kernel
def follow_points(
    # in
    bodies: wp.uint64,  # Bvh over the ways of the bodies, grouped by world
    surface: wp.uint64,  # Bvh over the ways of the triangles, grouped by body
    tris: wp.array[wp.vec3i],  # (n_tri,)
    tri_body: wp.array[int],  # (n_tri,)
    ends: wp.array[wp.vec2i],  # (n_point,) a point is in the middle between two vertices
    vert_body: wp.array[int],  # (n_vert,)
    body_world: wp.array[int],  # (n_body,)
    body_thickness: wp.array[float],  # (n_body,) [m]
    plane_n: wp.array[wp.vec3],  # (n_plane,)
    plane_h: wp.array[float],  # (n_plane,) [m]
    x0: wp.array[wp.vec3],  # (n_vert,) [m]
    x1: wp.array[wp.vec3],  # (n_vert,) [m]
    # in, out
    entered: wp.array[int],  # (n_point,) triangle by which it went into a body, -1 outside
    deep: wp.array[int],  # (n_point,) 1 where it has been deep in that body
    # out
    passed: wp.array[int],  # (n_point,) body, n_body + p for plane p, -1 for none
):
    """One thread per point: what it went through on its way from x0 to x1."""
    k = wp.tid()
    i = ends[k][0]
    j = ends[k][1]
    p0 = 0.5 * (x0[i] + x0[j])
    p1 = 0.5 * (x1[i] + x1[j])
    own = vert_body[i]
    inside = int(-1)
    inside_deep = int(0)
    through = int(-1)
    for m in range(plane_n.shape[0]):
        sunk = plane_h[m] - body_thickness[own]
        if wp.dot(plane_n[m], p0) >= sunk and wp.dot(plane_n[m], p1) < sunk:
            through = body_world.shape[0] + m
    world = body_world[own]
    body = next_in(bodies, world, wp.min(p0, p1), wp.max(p0, p1), -1)
    while body >= 0:
        if body != own:
            trip = trip_through(surface, body, tris, x0, x1, p0, p1)
            came = trip.came_tri
            been = int(0)
            if entered[k] >= 0 and tri_body[entered[k]] == body:
                came = entered[k]
                been = deep[k]
                trip.came = 0.0
            if came >= 0:
                out = trip.left_tri >= 0 and trip.left > trip.came
                middle = 0.5 * (trip.came + wp.where(out, trip.left, 1.0))
                p = between(p0, p1, middle)
                skin = SKIN * body_thickness[body]
                if is_deep(surface, body, tris, x0, x1, p, middle, skin):
                    been = 1
                if out and been == 1 and opposed(came, trip.left_tri, tris, x1):
                    through = body
                if trip.back > trip.left:
                    inside = trip.back_tri
                    inside_deep = 0
                    if trip.left_tri < 0:
                        inside_deep = been
                elif trip.left_tri < 0:
                    inside = came
                    inside_deep = been
        body = next_in(bodies, world, wp.min(p0, p1), wp.max(p0, p1), body)
    entered[k] = inside
    deep[k] = inside_deep
    passed[k] = through
