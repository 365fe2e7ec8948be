"""Stage 4, depth: consistent penetration depth and direction.

Heidelberger et al. 2004. A penetration is a vertex i at p in a body N. A vertex at the border has
tet edges to vertices outside N. Let x_k be the crossing of such an edge with the surface of N that
is nearest to the outer end, n_k the normal there and w_k = 1 / |x_k - p|^2. Then

    d(p) = sum w_k (x_k - p) . n_k / sum w_k          depth [m]
    r(p) = normalise(sum w_k n_k)                     direction, out of N

The others take both from neighbours p_j that have a depth, layer by layer, m_j = 1 / |p_j - p|^2:

    d(p) = sum m_j ((p_j - p) . r_j + d_j) / sum m_j
    r(p) = normalise(sum m_j r_j)

All tet edges take part. With surface edges alone, a vertex inside a flat face would have in-plane
neighbours only. Terms with (x_k - p) . n_k <= 0 leave by a side that faces away and are dropped. So
are terms through a face that no face of the vertex opposes (opposing.py).

The direction makes the contact. The depth only says whether the ray along it is trusted
(vertex_contact.py), whose length replaces it, and goes on to the next layer. Most vertices that lie
shallow, as at rest, take the closest triangles instead (shallow.py).
"""

import warp as wp

from warp_contact.kernels.mesh import Mesh
from warp_contact.kernels.narrow_phase.beside import Beside, list_beside
from warp_contact.kernels.narrow_phase.opposing import looks_against
from warp_contact.kernels.narrow_phase.shallow import place_of, shallow_depth
from warp_contact.kernels.narrow_phase.surface_query import corner_normals, first_hit, hit_point
from warp_contact.kernels.narrow_phase.vertices import (
    ABOVE,
    BELOW,
    BEYOND,
    Penetration,
    is_inside_of,
    penetrations_of,
)
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

GRAZING = wp.constant(5.0e-3)  # sine below which a tet edge lies in a wall and does not cross it


@wp.func
def edge_depth(
    e: Penetration,
    mesh: Mesh,
    x: wp.array[wp.vec3],
    pair_start: wp.array[int],
    inside_at: wp.array[int],
    penetration: wp.array[Penetration],
) -> Penetration:
    """The penetration with depth and direction from the crossing tet edges, if there are any."""
    root = wp.bvh_get_group_root(mesh.bvh, e.body)
    i = e.vert
    p = x[i]
    weight = float(0.0)
    depth = float(0.0)
    r = wp.vec3(0.0, 0.0, 0.0)
    normals = wp.mat33()  # of the triangle crossed last: most edges cross the same one
    crossed = int(-1)
    for k in range(mesh.vn_start[i], mesh.vn_start[i + 1]):
        j = mesh.vn_vert[k]
        if not is_inside_of(j, e.body, pair_start, inside_at, penetration):
            u = p - x[j]
            hit = first_hit(mesh.bvh, root, mesh.tris, x, x[j], u, -1.0e-6, -1.0, GRAZING)
            if hit.tri >= 0:
                if hit.tri != crossed:
                    crossed = hit.tri
                    t = mesh.tris[crossed]
                    normals = corner_normals(t, mesh.tris, mesh.vs_start, mesh.vs_tri, x)
                n = wp.normalize(normals * hit.w)
                gap = hit_point(hit, mesh.tris, x) - p
                d = wp.dot(gap, n)
                if d > 0.0 and looks_against(i, n, mesh.tris, mesh.vs_start, mesh.vs_tri, x):
                    w = 1.0 / wp.max(wp.length_sq(gap), 1.0e-12 * wp.length_sq(u))
                    weight += w
                    depth += w * d
                    r += w * n
    if weight > 0.0 and wp.length_sq(r) > 1.0e-6 * weight * weight:
        e.depth = depth / weight
        e.direction = wp.normalize(r)
        e.layer = 0
    return e


@wp.kernel
def border_depth(
    # in
    threads: int,
    shallow: float,  # of an edge: how far a depth is looked for without the edges
    mesh: Mesh,
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    pair_start: wp.array[int],  # (n_vert + 1,) first pair of each vertex
    inside_at: wp.array[int],  # (n_pair + 1,) penetrations before each pair
    travelled: wp.array[float],  # (n_body + n_plane,) [m]
    # in, out
    beside: Beside,
    penetration: wp.array[Penetration],  # (capacity,) layer 0 at the border
    # out, added to
    pending: wp.array[int],  # (1,) 1 when some penetration has no depth yet
):
    """For each penetration: depth and direction at the border, by the tet edges that cross it."""
    n_inside = wp.min(inside_at[inside_at.shape[0] - 1], penetration.shape[0])
    for e in range(wp.tid(), n_inside, threads):
        found = penetration[e]
        if found.body >= mesh.n_body or found.side == BEYOND:
            continue
        reach = shallow * mesh.body_edge[found.body]
        root = wp.bvh_get_group_root(mesh.bvh, found.body)
        spent = travelled[mesh.vert_body[found.vert]] + travelled[found.body]
        list_beside(found.pair, x[found.vert], root, reach, spent, mesh, x, beside)
        at = place_of(found, root, reach, mesh, x, beside)
        if at.side == BELOW:
            found = shallow_depth(found, at, reach, mesh, x, pair_start, inside_at, penetration)
        if at.side == ABOVE:
            found.side = ABOVE
            found.hit = at.hit
        elif found.layer < 0:
            found = edge_depth(found, mesh, x, pair_start, inside_at, penetration)
        penetration[e] = found
        if found.layer < 0:
            pending[0] = 1


@wp.kernel
def begin_layer(
    # in, out
    layer: wp.array[int],  # (1,) the layer that is filled next
    pending: wp.array[int],  # (1,)
):
    """One thread: begin a layer; ``pending`` stays 0 unless the layer has a penetration."""
    layer[0] = layer[0] + 1
    pending[0] = 0


@wp.kernel
def propagate(
    # in
    threads: int,
    layer: wp.array[int],  # (1,)
    mesh: Mesh,
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    pair_start: wp.array[int],  # (n_vert + 1,) first pair of each vertex
    inside_at: wp.array[int],  # (n_pair + 1,) penetrations before each pair
    # in, out
    penetration: wp.array[Penetration],  # (capacity,)
    pending: wp.array[int],  # (1,) 1 when this layer has a penetration
):
    """For each penetration without depth: take one from neighbours of earlier layers."""
    capacity = penetration.shape[0]
    n_inside = wp.min(inside_at[inside_at.shape[0] - 1], capacity)
    for e in range(wp.tid(), n_inside, threads):
        if penetration[e].layer >= 0 or penetration[e].side == BEYOND:
            continue
        i = penetration[e].vert
        weight = float(0.0)
        depth = float(0.0)
        r = wp.vec3(0.0, 0.0, 0.0)
        for k in range(mesh.vn_start[i], mesh.vn_start[i + 1]):
            j = mesh.vn_vert[k]
            around = penetrations_of(j, pair_start, inside_at, capacity)
            for f in range(around[0], around[1]):
                other = penetration[f]
                same = other.body == penetration[e].body
                if same and other.layer >= 0 and other.layer < layer[0]:
                    gap = x[j] - x[i]
                    w = 1.0 / wp.max(wp.length_sq(gap), 1.0e-20)
                    weight += w
                    depth += w * (wp.dot(gap, other.direction) + other.depth)
                    r += w * other.direction
        if weight > 0.0 and wp.length_sq(r) > 1.0e-6 * weight * weight:
            penetration[e].depth = depth / weight
            penetration[e].direction = wp.normalize(r)
            penetration[e].layer = layer[0]
            pending[0] = 1
