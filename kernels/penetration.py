"""Stage 2: consistent penetration depth and direction, and the contact triangle.

Heidelberger et al. 2004. A hit is (vertex i, penetrated body N). Border hits have a tet edge to a
vertex outside N; with x_k the crossing of such an edge with N's surface nearest the outer end,
n_k the normal there and w_k = 1 / |x_k - p|^2,

    d(p) = sum w_k (x_k - p) . n_k / sum w_k          depth [m]
    r(p) = normalise(sum w_k n_k)                     direction, out of N

The others take it over from processed neighbours p_j, layer by layer, with m_j = 1 / |p_j - p|^2:

    d(p) = sum m_j ((p_j - p) . r_j + d_j) / sum m_j
    r(p) = normalise(sum m_j r_j)

All tet edges take part: with surface edges alone, a vertex inside a flat face has in-plane
neighbours only. Terms with (x_k - p) . n_k <= 0 leave by a side that faces away and are dropped.
The contact point is where the ray p + t r leaves N (Spillmann & Teschner 2005, section 3.2), and t
replaces d. Where no direction is known, or the ray would leave much deeper than d tells, the
closest point of N's surface serves instead. So it does where the contact would have overlapped at
the start of the step already, and the closest point's less: the vertex came in by another side.

Triangle and direction are those at the predicted positions, the weights those at the start of the
step x0, seen along the direction: sum a_k x0_k is then parallel to the normal impulse and angular
momentum is kept, since L = sum m x0 x v for symplectic Euler.
"""

import warp as wp

from warp_contact.kernels.geometry import projected_weights
from warp_contact.kernels.hits import hit_range, is_hit
from warp_contact.kernels.surface_query import (
    Hit,
    closest_hit,
    first_hit,
    hit_normal,
    hit_point,
    leaving_hit,
)

wp.set_module_options({"enable_backward": False})

SLIP = wp.constant(1.0)  # change of the weights in a step above which they are taken at its end
STALE = wp.constant(0.02)  # of an edge: overlap at the start of a step that tells a wrong direction
FLUSH = wp.constant(1.0e-5)  # of an edge: a vertex this deep lies in the surface
GRAZING = wp.constant(5.0e-3)  # sine below which a tet edge lies in a wall and does not cross it
FAR = wp.constant(3.0)  # a ray this many times longer than the depth is not trusted


@wp.kernel
def border_depth(
    # in
    n_body: int,
    surface: wp.uint64,  # Bvh over the triangles, grouped by body
    tris: wp.array[wp.vec3i],  # (n_tri,)
    vs_start: wp.array[int],  # (n_vert + 1,)
    vs_tri: wp.array[int],  # (3 n_tri,)
    vn_start: wp.array[int],  # (n_vert + 1,)
    vn_vert: wp.array[int],  # (2 n_edge of the tets,)
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    pair_start: wp.array[int],  # (n_vert + 1,) candidates of each vertex
    hit_at: wp.array[int],  # (n_pair + 1,) hits before each candidate
    hit_vert: wp.array[int],  # (capacity,)
    hit_body: wp.array[int],  # (capacity,)
    # out
    hit_depth: wp.array[float],  # (capacity,) [m]
    hit_dir: wp.array[wp.vec3],  # (capacity,)
    hit_layer: wp.array[int],  # (capacity,) 0 for a border hit, untouched otherwise
    # out, added to
    pending: wp.array[int],  # (1,) 1 when some hit has no depth yet
):
    """One thread per hit: depth and direction from the crossing tet edges."""
    e = wp.tid()
    if e >= wp.min(hit_at[hit_at.shape[0] - 1], hit_vert.shape[0]):
        return
    i = hit_vert[e]
    body = hit_body[e]
    if body >= n_body:
        return
    p = x[i]
    weight = float(0.0)
    depth = float(0.0)
    r = wp.vec3(0.0, 0.0, 0.0)
    for k in range(vn_start[i], vn_start[i + 1]):
        j = vn_vert[k]
        if not is_hit(j, body, pair_start, hit_at, hit_body):
            u = p - x[j]
            hit = first_hit(surface, body, tris, x, x[j], u, -1.0e-6, -1.0, GRAZING)
            if hit.tri >= 0:
                n = hit_normal(hit, tris, vs_start, vs_tri, x)
                gap = hit_point(hit, tris, x) - p
                d = wp.dot(gap, n)
                if d > 0.0:
                    w = 1.0 / wp.max(wp.length_sq(gap), 1.0e-12 * wp.length_sq(u))
                    weight += w
                    depth += w * d
                    r += w * n
    if weight > 0.0 and wp.length_sq(r) > 1.0e-6 * weight * weight:
        hit_depth[e] = depth / weight
        hit_dir[e] = wp.normalize(r)
        hit_layer[e] = 0
    else:
        pending[0] = 1


@wp.kernel
def begin_layer(
    # in, out
    layer: wp.array[int],  # (1,) the layer that is filled next
    pending: wp.array[int],  # (1,)
):
    """One thread: count the layer; ``pending`` stays 0 unless the layer fills a hit."""
    layer[0] = layer[0] + 1
    pending[0] = 0


@wp.kernel
def propagate(
    # in
    n_body: int,
    layer: wp.array[int],  # (1,)
    vn_start: wp.array[int],  # (n_vert + 1,)
    vn_vert: wp.array[int],  # (2 n_edge of the tets,)
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    pair_start: wp.array[int],  # (n_vert + 1,) candidates of each vertex
    hit_at: wp.array[int],  # (n_pair + 1,) hits before each candidate
    hit_vert: wp.array[int],  # (capacity,)
    hit_body: wp.array[int],  # (capacity,)
    # in, out
    hit_depth: wp.array[float],  # (capacity,) [m]
    hit_dir: wp.array[wp.vec3],  # (capacity,)
    hit_layer: wp.array[int],  # (capacity,)
    pending: wp.array[int],  # (1,) 1 when this layer filled a hit
):
    """One thread per hit without depth: take it over from neighbours of earlier layers."""
    e = wp.tid()
    if e >= wp.min(hit_at[hit_at.shape[0] - 1], hit_vert.shape[0]) or hit_layer[e] >= 0:
        return
    i = hit_vert[e]
    weight = float(0.0)
    depth = float(0.0)
    r = wp.vec3(0.0, 0.0, 0.0)
    for k in range(vn_start[i], vn_start[i + 1]):
        j = vn_vert[k]
        around = hit_range(j, pair_start, hit_at, hit_vert.shape[0])
        for f in range(around[0], around[1]):
            if hit_body[f] == hit_body[e] and hit_layer[f] >= 0 and hit_layer[f] < layer[0]:
                gap = x[j] - x[i]
                w = 1.0 / wp.max(wp.length_sq(gap), 1.0e-20)
                weight += w
                depth += w * (wp.dot(gap, hit_dir[f]) + hit_depth[f])
                r += w * hit_dir[f]
    if weight > 0.0 and wp.length_sq(r) > 1.0e-6 * weight * weight:
        hit_depth[e] = depth / weight
        hit_dir[e] = wp.normalize(r)
        hit_layer[e] = layer[0]
        pending[0] = 1


@wp.struct
class VertexContact:
    hit: Hit
    n: wp.vec3
    start: float  # gap at the start of the step [m]


@wp.func
def along(
    hit: Hit, i: int, n: wp.vec3, tris: wp.array[wp.vec3i], x0: wp.array[wp.vec3]
) -> VertexContact:
    """The contact of vertex i with a hit, along n."""
    out = VertexContact()
    out.hit = hit
    out.n = n
    out.start = wp.dot(x0[i] - hit_point(hit, tris, x0), n)
    return out


@wp.func
def outward(hit: Hit, i: int, tris: wp.array[wp.vec3i], x: wp.array[wp.vec3]) -> wp.vec3:
    """From vertex i to its closest point, or along the face where i is outside or on it."""
    t = tris[hit.tri]
    n = wp.normalize(wp.cross(x[t[1]] - x[t[0]], x[t[2]] - x[t[0]]))
    gap = hit_point(hit, tris, x) - x[i]
    if wp.dot(gap, n) > 0.0:
        n = wp.normalize(gap)
    return n


@wp.kernel
def vertex_contacts(
    # in
    n_body: int,
    fresh: bool,  # there are no overlaps from before the step
    surface: wp.uint64,  # Bvh over the triangles, grouped by body
    tris: wp.array[wp.vec3i],  # (n_tri,)
    body_edge: wp.array[float],  # (n_body,) [m]
    vert_body: wp.array[int],  # (n_vert,)
    on_surface: wp.array[int],  # (n_vert,)
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
    """One thread per hit: contact c = hit e of a surface vertex with a triangle or a plane."""
    e = wp.tid()
    if e >= wp.min(hit_at[hit_at.shape[0] - 1], hit_vert.shape[0]):
        return
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
        return
    if on_surface[i] == 0:
        return
    edge = body_edge[body]
    known = hit_layer[e] >= 0
    out = VertexContact()
    if known:
        ray = leaving_hit(surface, body, tris, x, x[i], hit_dir[e])
        known = ray.tri >= 0 and ray.t <= FAR * wp.max(hit_depth[e], 0.0) + 0.05 * edge
        if known:
            out = along(ray, i, hit_dir[e], tris, x0)
    if not known or (fresh and out.start < -STALE * edge):
        near = closest_hit(surface, body, tris, x, x[i], 0.1 * edge)
        if near.tri >= 0:
            other = along(near, i, outward(near, i, tris, x), tris, x0)
            if not known or other.start > out.start:
                out = other
                known = True
                if near.t < FLUSH * edge:
                    return
    if not known:
        return
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
    depth[e] = out.hit.t
