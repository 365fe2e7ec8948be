"""Stage 2, vertices: the contact of each hit with a triangle or a plane.

The contact point is where the ray from the vertex along its direction leaves the body (Spillmann &
Teschner 2005, section 3.2), and the way to there replaces the depth. Where no direction is known,
or the ray would leave much deeper than the depth tells, the closest point of the surface serves
instead. So it does where the contact would have overlapped at the start of the step already, and
the closest point's less: the vertex came in by another side. Where that would have overlapped too,
close to a rim, it is led back through the triangle by which it came in.

A vertex in the skin, outside, makes a contact with a gap. The impulses then know of it before it
closes: what rests stays in contact in every step, and its force does not come in blows.

Triangle and direction are those at the predicted positions, the weights those at the start of the
step x0, seen along the direction: sum a_k x0_k is then parallel to the normal impulse and angular
momentum is kept, since L = sum m x0 x v for symplectic Euler.
"""

import warp as wp

from warp_contact.kernels.geometry import projected_weights
from warp_contact.kernels.narrow_phase.opposing import along, closest_opposing, looks
from warp_contact.kernels.narrow_phase.surface_query import (
    Hit,
    closest_hit,
    face_normal,
    hit_point,
    inner_side,
    leaving_hit,
)
from warp_contact.kernels.narrow_phase.vertices import SKIN
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

SLIP = wp.constant(1.0)  # change of the weights in a step above which they are taken at its end
STALE = wp.constant(
    2.0e-3
)  # of an edge: overlap at the start of a step that tells a wrong direction
NEAR = wp.constant(0.05)  # of an edge: a vertex this close to a wall may lie in it
FLUSH = wp.constant(1.0e-5)  # of an edge: a vertex this deep lies in the surface
BESIDE = wp.constant(0.1)  # weights: where a ray from inside the body leaves far from that outside
FAR = wp.constant(3.0)  # a ray this many times longer than the depth is not trusted
ASTRAY = wp.constant(2.0)  # nor a way back this many times longer than that of the step


@wp.struct
class VertexContact:
    found: bool
    hit: Hit
    n: wp.vec3
    start: float  # gap at the start of the step [m]


@wp.func
def contact_at(
    hit: Hit, i: int, n: wp.vec3, tris: wp.array[wp.vec3i], x0: wp.array[wp.vec3]
) -> VertexContact:
    """The contact of vertex i with a hit, along n."""
    out = VertexContact()
    out.found = True
    out.hit = hit
    out.n = n
    out.start = wp.dot(x0[i] - hit_point(hit, tris, x0), n)
    return out


@wp.func
def inner_contact(
    surface: wp.uint64,
    root: int,
    tris: wp.array[wp.vec3i],
    x0: wp.array[wp.vec3],
    x: wp.array[wp.vec3],
    i: int,
    layer: int,
    depth: float,  # [m]
    r: wp.vec3,
    edge: float,  # [m]
) -> VertexContact:
    """Where the ray of vertex i along its direction leaves the body."""
    out = VertexContact()
    if layer < 0 or depth <= 0.0:
        return out
    ray = leaving_hit(surface, root, tris, x, x[i], r)
    if ray.tri < 0:  # in the skin, beside the body: from just inside it
        near = closest_hit(surface, root, tris, x, x[i], 0.1 * edge)
        inner = hit_point(near, tris, x) - 2.0 * SKIN * edge * face_normal(tris[near.tri], x)
        ray = leaving_hit(surface, root, tris, x, inner, r)
        if ray.tri >= 0:
            ray.t = wp.dot(hit_point(ray, tris, x) - x[i], r)
            t = tris[ray.tri]
            own = projected_weights(x[i], r, x[t[0]], x[t[1]], x[t[2]])
            if wp.length(own - ray.w) > BESIDE:
                return out
    if ray.tri >= 0 and ray.t > 0.0 and ray.t <= FAR * depth + NEAR * edge:
        out = contact_at(ray, i, r, tris, x0)
    return out


@wp.func
def closest_contact(
    surface: wp.uint64,
    root: int,
    tris: wp.array[wp.vec3i],
    vs_start: wp.array[int],
    vs_tri: wp.array[int],
    x0: wp.array[wp.vec3],
    x: wp.array[wp.vec3],
    i: int,
    edge: float,  # [m]
) -> VertexContact:
    """The contact of vertex i with the closest point of the surface."""
    out = VertexContact()
    near = closest_hit(surface, root, tris, x, x[i], 0.1 * edge)
    inside = inner_side(near, tris, x, x[i])
    if inside <= FLUSH * edge:
        near = closest_opposing(surface, root, tris, vs_start, vs_tri, x, i, 2.0 * SKIN * edge)
    if near.tri < 0:
        return out
    n = face_normal(tris[near.tri], x)
    if near.t < NEAR * edge and along(looks(i, n, tris, vs_start, vs_tri, x)):
        return out
    gap = hit_point(near, tris, x) - x[i]
    if wp.dot(gap, n) > 0.0:
        n = wp.normalize(gap)
    return contact_at(near, i, n, tris, x0)


@wp.func
def entry_contact(
    surface: wp.uint64,
    root: int,
    tris: wp.array[wp.vec3i],
    x0: wp.array[wp.vec3],
    x: wp.array[wp.vec3],
    i: int,
    edge: float,  # [m]
) -> VertexContact:
    """The contact of vertex i with the triangle by which it came in since the step began.

    The way is measured against the closest point of the surface, as the body may move too.
    """
    out = VertexContact()
    near = closest_hit(surface, root, tris, x, x[i], 0.1 * edge)
    if inner_side(near, tris, x, x[i]) <= 0.0:
        return out
    back = x0[i] - hit_point(near, tris, x0) - (x[i] - hit_point(near, tris, x))
    if wp.length_sq(back) == 0.0:
        return out
    ray = leaving_hit(surface, root, tris, x, x[i], wp.normalize(back))
    if ray.tri >= 0 and ray.t <= ASTRAY * wp.length(back):
        out = contact_at(ray, i, face_normal(tris[ray.tri], x), tris, x0)
    return out


@wp.kernel
def vertex_contacts(
    # in
    threads: int,
    n_body: int,
    fresh: bool,  # there are no overlaps from before the step
    surface: wp.uint64,  # Bvh over the triangles, grouped by body
    tris: wp.array[wp.vec3i],  # (n_tri,)
    body_edge: wp.array[float],  # (n_body,) [m]
    vert_body: wp.array[int],  # (n_vert,)
    on_surface: wp.array[int],  # (n_vert,)
    vs_start: wp.array[int],  # (n_vert + 1,)
    vs_tri: wp.array[int],  # (3 n_tri,)
    plane_n: wp.array[wp.vec3],  # (n_plane,)
    plane_h: wp.array[float],  # (n_plane,) [m]
    x0: wp.array[wp.vec3],  # (n_vert,) [m] start of the step
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    hit_at: wp.array[int],  # (n_pair + 1,)
    hit_vert: wp.array[int],  # (capacity,)
    hit_body: wp.array[int],  # (capacity,)
    hit_layer: wp.array[int],  # (capacity,)
    hit_depth: wp.array[float],  # (capacity,) [m]
    hit_dir: wp.array[wp.vec3],  # (capacity,)
    # out
    vert: wp.array2d[int],  # (capacity, 5)
    coef: wp.array2d[float],  # (capacity, 5), all 0 for a hit that makes no contact
    normal: wp.array[wp.vec3],  # (capacity,)
    depth: wp.array[float],  # (capacity,) [m]
    offset: wp.array[float],  # (capacity,) [m] gap = (sum coef x) . normal - offset
    pair: wp.array[wp.vec2i],  # (capacity,)
):
    """For each hit: contact c = hit e of a surface vertex with a triangle or a plane."""
    for e in range(wp.tid(), wp.min(hit_at[hit_at.shape[0] - 1], hit_vert.shape[0]), threads):
        i = hit_vert[e]
        body = hit_body[e]
        for k in range(5):
            vert[e, k] = i
            coef[e, k] = 0.0
        depth[e] = 0.0
        offset[e] = 0.0
        normal[e] = wp.vec3(0.0, 0.0, 0.0)
        pair[e] = wp.vec2i(vert_body[i], body)
        if body >= n_body:
            n = plane_n[body - n_body]
            coef[e, 0] = 1.0
            normal[e] = n
            offset[e] = plane_h[body - n_body]
            depth[e] = offset[e] - wp.dot(n, x[i])
            continue
        if on_surface[i] == 0:
            continue
        root = wp.bvh_get_group_root(surface, body)
        out = inner_contact(
            surface, root, tris, x0, x, i, hit_layer[e], hit_depth[e], hit_dir[e], body_edge[body]
        )
        if not out.found or (fresh and out.start < -STALE * body_edge[body]):
            near = closest_contact(surface, root, tris, vs_start, vs_tri, x0, x, i, body_edge[body])
            if near.found and not (out.found and out.start >= near.start):
                out = near
        if out.found and fresh and out.start < -STALE * body_edge[body]:
            entry = entry_contact(surface, root, tris, x0, x, i, body_edge[body])
            if entry.found and entry.start >= -STALE * body_edge[body]:
                out = entry
        if not out.found:
            continue
        t = tris[out.hit.tri]
        r = out.n
        w = projected_weights(x0[i], r, x0[t[0]], x0[t[1]], x0[t[2]])
        if wp.length(w - out.hit.w) > SLIP:
            w = out.hit.w
        vert[e, 2] = t[0]
        vert[e, 3] = t[1]
        vert[e, 4] = t[2]
        coef[e, 0] = 1.0
        coef[e, 2] = -w[0]
        coef[e, 3] = -w[1]
        coef[e, 4] = -w[2]
        normal[e] = r
        depth[e] = wp.dot(hit_point(out.hit, tris, x) - x[i], r)
