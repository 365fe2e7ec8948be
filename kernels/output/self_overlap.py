"""The overlaps of a body with itself: where it is folded, or pieces of one mesh lie in each other.

A surface vertex overlaps its own body where a tet of which it is no corner contains it. So does a
surface edge that goes into the body and comes out again, at the middle of that piece. In a tet next
to its own ones it must be deeper than ``SELF_DEEP``, as rounding puts the corner of a flat tet into
the next one. A corner of an inverted tet is left out: it lies in a neighbour without any fold.

The depth is the distance to the closest triangle that lies behind: one that does not look where the
vertex or the edge looks, and that has it on its inner side. So it is at most the thickness of what
went in. Beyond some edges it is that along the normal, as a body may overlap itself as a whole.
"""

import warp as wp

from warp_contact.kernels.geometry import NONE, PARALLEL, area_vector, segment_hit, tet_weights
from warp_contact.kernels.lengths import FLUSH, SELF_DEEP
from warp_contact.kernels.mesh import Mesh
from warp_contact.kernels.narrow_phase.surface_query import Hit, closer
from warp_contact.kernels.narrow_phase.vertices import distance_to_faces
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

DOUBLINGS = wp.constant(6)  # of the radius of a query, to 3.2 edges: a body may overlap as a whole
ASIDE = wp.constant(0.1)  # cosine between normals up to which two faces do not look the same way


@wp.func
def has(t: wp.vec4i, i: int) -> bool:
    return t[0] == i or t[1] == i or t[2] == i or t[3] == i


@wp.func
def touches(t: wp.vec3i, i: int) -> bool:
    return t[0] == i or t[1] == i or t[2] == i


@wp.func
def volume(t: wp.vec4i, x: wp.array[wp.vec3]) -> float:
    """Six times the volume of a tet [m^3]."""
    a = x[t[0]]
    return wp.dot(x[t[1]] - a, wp.cross(x[t[2]] - a, x[t[3]] - a))


@wp.func
def is_linked(mesh: Mesh, i: int, k: int) -> bool:
    """Whether an edge of a tet joins the vertices i and k, or they are the same."""
    for e in range(mesh.vn_start[i], mesh.vn_start[i + 1]):
        if mesh.vn_vert[e] == k:
            return True
    return i == k


@wp.func
def is_next(mesh: Mesh, t: wp.vec4i, i: int) -> bool:
    """Whether tet t shares a corner with a tet of vertex i."""
    return (
        is_linked(mesh, i, t[0])
        or is_linked(mesh, i, t[1])
        or is_linked(mesh, i, t[2])
        or is_linked(mesh, i, t[3])
    )


@wp.func
def is_inside(mesh: Mesh, x: wp.array[wp.vec3], t: wp.vec4i, p: wp.vec3, i: int, j: int) -> bool:
    """Whether tet t contains p, vertex i or on the edge from i to j; of which t is no part."""
    a = x[t[0]]
    b = x[t[1]]
    c = x[t[2]]
    d = x[t[3]]
    if wp.min(tet_weights(p, a, b, c, d)) < -FLUSH:
        return False
    if not (is_next(mesh, t, i) or is_next(mesh, t, j)):
        return True
    deep = SELF_DEEP * mesh.body_edge[mesh.vert_body[i]]
    return wp.min(tet_weights(p, a, b, c, d)) > 0.0 and distance_to_faces(p, a, b, c, d) > deep


@wp.func
def is_in_itself(
    volumes: wp.uint64,
    root: int,
    mesh: Mesh,
    x: wp.array[wp.vec3],
    p: wp.vec3,
    i: int,  # p is the vertex i, or on the edge from i to j
    j: int,
) -> bool:
    """Whether a tet of its body contains p, of which it is no part; not where one is inverted."""
    inside = bool(False)
    q = int(0)
    own = mesh.vert_body[i]
    query = wp.bvh_query_aabb(volumes, p, p, root)
    while wp.bvh_query_next(query, q):
        t = mesh.tets[q]
        if mesh.vert_body[t[0]] == own:
            if has(t, i) and has(t, j):
                if volume(t, x) <= 0.0:
                    return False
            elif not inside:
                inside = is_inside(mesh, x, t, p, i, j)
    return inside


@wp.func
def lies_behind(
    t: wp.vec3i, x: wp.array[wp.vec3], p: wp.vec3, n: wp.vec3, flush: float, i: int, j: int
) -> bool:
    """Whether triangle t does not look along n, and p is on its inner side or flush with it."""
    face = area_vector(x[t[0]], x[t[1]], x[t[2]])
    size = wp.length(face)
    if wp.dot(n, face) >= ASIDE * size or wp.dot(p - x[t[0]], face) >= flush * size:
        return False
    return not (touches(t, i) or touches(t, j))


@wp.func
def way_out(
    mesh: Mesh,
    x: wp.array[wp.vec3],
    p: wp.vec3,
    n: wp.vec3,  # unit, outward where p is
    i: int,  # p is the vertex i, or on the edge from i to j
    j: int,
) -> float:
    """Distance of p to the closest triangle of its body that lies behind it [m].

    If that is more than some edges, the distance to the plane of the first one along -n.
    """
    best = Hit()
    best.tri = -1
    best.t = NONE
    k = int(0)
    body = mesh.vert_body[i]
    flush = SELF_DEEP * mesh.body_edge[body]
    root = wp.bvh_get_group_root(mesh.bvh, body)
    radius = 0.1 * mesh.body_edge[body]
    for _attempt in range(DOUBLINGS):
        grow = wp.vec3(radius, radius, radius)
        query = wp.bvh_query_aabb(mesh.bvh, p - grow, p + grow, root)
        while wp.bvh_query_next(query, k):
            if lies_behind(mesh.tris[k], x, p, n, flush, i, j):
                best = closer(best, k, mesh.tris, x, p)
        if best.t <= radius:
            return best.t
        radius = 2.0 * radius
    ahead = float(NONE)
    depth = 0.5 * radius  # nothing closer was found
    ray = wp.bvh_query_ray(mesh.bvh, p, -n, root)
    while wp.bvh_query_next(ray, k, ahead):
        t = mesh.tris[k]
        h = segment_hit(p, -n, x[t[0]], x[t[1]], x[t[2]], PARALLEL)
        if h[0] >= 0.0 and h[0] < ahead and lies_behind(t, x, p, n, flush, i, j):
            ahead = h[0]
            face = wp.normalize(area_vector(x[t[0]], x[t[1]], x[t[2]]))
            depth = wp.max(0.5 * radius, wp.dot(x[t[0]] - p, face))
    return depth


@wp.func
def self_overlap(
    volumes: wp.uint64,
    root: int,
    mesh: Mesh,
    x: wp.array[wp.vec3],
    p: wp.vec3,
    n: wp.vec3,
    i: int,
    j: int,
) -> float:
    """Depth of vertex i, or of a point of the edge to j, in its own body [m]; n is outward."""
    if not is_in_itself(volumes, root, mesh, x, p, i, j):
        return 0.0
    depth = way_out(mesh, x, p, wp.normalize(n), i, j)
    return wp.where(depth > SELF_DEEP * mesh.body_edge[mesh.vert_body[i]], depth, 0.0)


@wp.kernel
def vertex_self_overlaps(
    # in
    volumes: wp.uint64,  # Bvh over the tets, grouped by world
    mesh: Mesh,
    surf: wp.array[int],  # (n_surf,)
    body_world: wp.array[int],  # (n_body,)
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    overlap: wp.array[float],  # (n_surf,) [m]
):
    """One thread per surface vertex: its overlap with its own body."""
    k = wp.tid()
    i = surf[k]
    n = wp.vec3(0.0)
    for e in range(mesh.vs_start[i], mesh.vs_start[i + 1]):
        t = mesh.tris[mesh.vs_tri[e]]
        n += area_vector(x[t[0]], x[t[1]], x[t[2]])
    root = wp.bvh_get_group_root(volumes, body_world[mesh.vert_body[i]])
    overlap[k] = self_overlap(volumes, root, mesh, x, x[i], n, i, i)


@wp.func
def inner_piece(mesh: Mesh, x: wp.array[wp.vec3], i: int, j: int) -> wp.vec2:
    """Where the edge from i to j first goes into its body and next comes out, NONE for not."""
    p = x[i]
    u = x[j] - p
    into = float(NONE)
    out = float(NONE)
    k = int(0)
    root = wp.bvh_get_group_root(mesh.bvh, mesh.vert_body[i])
    query = wp.bvh_query_aabb(mesh.bvh, wp.min(p, p + u), wp.max(p, p + u), root)
    while wp.bvh_query_next(query, k):
        t = mesh.tris[k]
        if not (touches(t, i) or touches(t, j)):
            h = segment_hit(p, u, x[t[0]], x[t[1]], x[t[2]], PARALLEL)
            if h[0] > 0.0 and h[0] < 1.0:
                if wp.dot(u, area_vector(x[t[0]], x[t[1]], x[t[2]])) < 0.0:
                    into = wp.min(into, h[0])
                else:
                    out = wp.min(out, h[0])
    return wp.vec2(into, out)


@wp.kernel
def edge_self_overlaps(
    # in
    volumes: wp.uint64,  # Bvh over the tets, grouped by world
    mesh: Mesh,
    body_world: wp.array[int],  # (n_body,)
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    overlap: wp.array[float],  # (n_edge,) [m]
):
    """One thread per surface edge: the overlap of the middle of its inner piece with its body."""
    e = wp.tid()
    overlap[e] = 0.0
    i = mesh.edges[e][0]
    j = mesh.edges[e][1]
    piece = inner_piece(mesh, x, i, j)
    if piece[0] >= piece[1] or piece[1] > 1.0:
        return
    n = wp.vec3(0.0)
    for k in range(2, 4):
        t = mesh.tris[mesh.edges[e][k]]
        n += area_vector(x[t[0]], x[t[1]], x[t[2]])
    p = x[i] + 0.5 * (piece[0] + piece[1]) * (x[j] - x[i])
    root = wp.bvh_get_group_root(volumes, body_world[mesh.vert_body[i]])
    overlap[e] = self_overlap(volumes, root, mesh, x, p, n, i, j)
