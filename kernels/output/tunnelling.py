"""Tunnelling: which points went through a body or a plane from one state to the next.

A point and the triangles of a body move straight from one state to the next; crossing_time.py says
when they meet. A point went through if it entered by one face and left by one that faces the other
way. If it left by the same face, or round a corner, it did not. On its way it must also have been
deeper than ``DEEP`` of the thickness of the body: a vertex that grazes a base from rim to rim does
not go through the body.
"""

import warp as wp

from warp_contact.kernels.broad_phase.bounds import next_in
from warp_contact.kernels.geometry import NONE, triangle_closest
from warp_contact.kernels.lengths import BOX_GROWTH
from warp_contact.kernels.mesh import Mesh
from warp_contact.kernels.narrow_phase.surface_query import face_normal
from warp_contact.kernels.options import OPTIONS
from warp_contact.kernels.output.crossing_time import (
    Relative,
    between,
    crossing_time,
    height,
    turning,
)
from warp_contact.kernels.ties.attachment import Partners, hang_together

wp.set_module_options(OPTIONS)

OPPOSED = wp.constant(-0.5)  # cosine between two faces that face away from each other
DEEP = wp.constant(0.1)  # of the thickness of a body


@wp.struct
class Trip:
    """Times and triangles of the first entry, the last entry and the last exit; -1: none."""

    came: float
    came_tri: int
    back: float
    back_tri: int
    left: float
    left_tri: int


@wp.struct
class Inside:
    """The points that are in a body."""

    entered: wp.array[int]  # (n_point,) triangle by which it went in, -1 outside
    deep: wp.array[int]  # (n_point,) 1 where it has been deep in that body


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
    """The crossings of a point with the surface of a body, from p0 to p1."""
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
    reach: float,  # [m]
) -> bool:
    """Whether all triangles of the body are further from p than the reach, at time s."""
    deep = bool(True)
    t = int(0)
    grow = wp.vec3(reach, reach, reach)
    root = wp.bvh_get_group_root(surface, body)
    query = wp.bvh_query_aabb(surface, p - grow, p + grow, root)
    while wp.bvh_query_next(query, t):
        a = between(x0[tris[t][0]], x1[tris[t][0]], s)
        b = between(x0[tris[t][1]], x1[tris[t][1]], s)
        c = between(x0[tris[t][2]], x1[tris[t][2]], s)
        w = triangle_closest(p, a, b, c)
        if wp.length(w[0] * (a - p) + w[1] * (b - p) + w[2] * (c - p)) < reach:
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
    """One thread per triangle: the box of its path."""
    k = wp.tid()
    t = tris[k]
    g = BOX_GROWTH * body_edge[tri_body[k]]
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
    bodies: wp.uint64,  # Bvh over the paths of the bodies, grouped by world
    mesh: Mesh,  # its Bvh is over the paths of the triangles
    ends: wp.array[wp.vec2i],  # (n_point,) a point is in the middle between two vertices
    body_world: wp.array[int],  # (n_body,)
    body_thickness: wp.array[float],  # (n_body,) [m]
    partners: Partners,  # bodies that hang together may pass through each other
    x0: wp.array[wp.vec3],  # (n_vert,) [m]
    x1: wp.array[wp.vec3],  # (n_vert,) [m]
    # in, out
    inside: Inside,
    # out
    passed: wp.array[int],  # (n_point,) body, n_body + p for plane p, -1 for none
):
    """One thread per point: what it went through on its way from x0 to x1."""
    k = wp.tid()
    i = ends[k][0]
    j = ends[k][1]
    p0 = 0.5 * (x0[i] + x0[j])
    p1 = 0.5 * (x1[i] + x1[j])
    own = mesh.vert_body[i]
    entered = int(-1)
    deep = int(0)
    through = int(-1)
    for m in range(mesh.plane_n.shape[0]):
        sunk = mesh.plane_h[m] - body_thickness[own]
        if wp.dot(mesh.plane_n[m], p0) >= sunk and wp.dot(mesh.plane_n[m], p1) < sunk:
            through = mesh.n_body + m
    world = body_world[own]
    body = next_in(bodies, world, wp.min(p0, p1), wp.max(p0, p1), -1)
    while body >= 0:
        if body != own and not hang_together(partners, own, body):
            trip = trip_through(mesh.bvh, body, mesh.tris, x0, x1, p0, p1)
            came = trip.came_tri
            been = int(0)
            if inside.entered[k] >= 0 and mesh.tri_body[inside.entered[k]] == body:
                came = inside.entered[k]
                been = inside.deep[k]
                trip.came = 0.0
            if came >= 0:
                out = trip.left_tri >= 0 and trip.left > trip.came
                middle = 0.5 * (trip.came + wp.where(out, trip.left, 1.0))
                p = between(p0, p1, middle)
                deepest = DEEP * body_thickness[body]
                if is_deep(mesh.bvh, body, mesh.tris, x0, x1, p, middle, deepest):
                    been = 1
                if out and been == 1 and opposed(came, trip.left_tri, mesh.tris, x1):
                    through = body
                if trip.back > trip.left:
                    entered = trip.back_tri
                    deep = 0
                    if trip.left_tri < 0:
                        deep = been
                elif trip.left_tri < 0:
                    entered = came
                    deep = been
        body = next_in(bodies, world, wp.min(p0, p1), wp.max(p0, p1), body)
    inside.entered[k] = entered
    inside.deep[k] = deep
    passed[k] = through
