"""Stage 2: consistent penetration depth and direction.

Heidelberger et al. 2004. A hit is (vertex i, penetrated body N). Border hits have a tet edge to a
vertex outside N; with x_k the crossing of such an edge with N's surface nearest the outer end,
n_k the normal there and w_k = 1 / |x_k - p|^2,

    d(p) = sum w_k (x_k - p) . n_k / sum w_k          depth [m]
    r(p) = normalise(sum w_k n_k)                     direction, out of N

The others take it over from processed neighbours p_j, layer by layer, with m_j = 1 / |p_j - p|^2:

    d(p) = sum m_j ((p_j - p) . r_j + d_j) / sum m_j
    r(p) = normalise(sum m_j r_j)

All tet edges take part: with surface edges alone, a vertex inside a flat face has in-plane
neighbours only. Terms with (x_k - p) . n_k <= 0 leave by a side that faces away and are dropped. So
are those through a side that the vertex does not look against (opposing.py).
"""

import warp as wp

from warp_contact.kernels.narrow_phase.opposing import looks_against
from warp_contact.kernels.narrow_phase.surface_query import corner_normals, first_hit, hit_point
from warp_contact.kernels.narrow_phase.vertices import hit_range, is_hit
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

GRAZING = wp.constant(5.0e-3)  # sine below which a tet edge lies in a wall and does not cross it


@wp.kernel
def border_depth(
    # in
    threads: int,
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
    """For each hit: depth and direction from the crossing tet edges."""
    for e in range(wp.tid(), wp.min(hit_at[hit_at.shape[0] - 1], hit_vert.shape[0]), threads):
        i = hit_vert[e]
        body = hit_body[e]
        if body >= n_body:
            continue
        root = wp.bvh_get_group_root(surface, body)
        p = x[i]
        weight = float(0.0)
        depth = float(0.0)
        r = wp.vec3(0.0, 0.0, 0.0)
        normals = wp.mat33()  # of the triangle crossed last: most edges cross the same one
        crossed = int(-1)
        for k in range(vn_start[i], vn_start[i + 1]):
            j = vn_vert[k]
            if not is_hit(j, body, pair_start, hit_at, hit_body):
                u = p - x[j]
                hit = first_hit(surface, root, tris, x, x[j], u, -1.0e-6, -1.0, GRAZING)
                if hit.tri >= 0:
                    if hit.tri != crossed:
                        crossed = hit.tri
                        normals = corner_normals(tris[crossed], tris, vs_start, vs_tri, x)
                    n = wp.normalize(normals * hit.w)
                    gap = hit_point(hit, tris, x) - p
                    d = wp.dot(gap, n)
                    if d > 0.0 and looks_against(i, n, tris, vs_start, vs_tri, x):
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
    threads: int,
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
    """For each hit without depth: take it over from neighbours of earlier layers."""
    for e in range(wp.tid(), wp.min(hit_at[hit_at.shape[0] - 1], hit_vert.shape[0]), threads):
        if hit_layer[e] >= 0:
            continue
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
