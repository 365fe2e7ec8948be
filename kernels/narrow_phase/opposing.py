"""By which faces of another body a vertex or an edge may leave it.

Where two bodies touch, their surfaces face each other. A face that points the same way as the
faces of the vertex or edge is no way out, however close it is. Example: the rims of two blocks that
stand flush on each other lie in each other's side walls, and must not be pushed out through them.

    opposes    the face points against an own face                      n . n_own < -LEAN
    along      it points the way of an own face and opposes none        n . n_own > ALONG
"""

import warp as wp

from warp_contact.kernels.geometry import area_vector
from warp_contact.kernels.narrow_phase.surface_query import Hit, closer, face_normal
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

LEAN = wp.constant(0.1)  # cosine: beyond it, two faces point against each other
ALONG = wp.constant(0.7)  # cosine: beyond it, two faces point the same way


@wp.func
def looks(
    i: int,
    n: wp.vec3,
    tris: wp.array[wp.vec3i],
    vs_start: wp.array[int],
    vs_tri: wp.array[int],
    x: wp.array[wp.vec3],
) -> wp.vec2:
    """Least and largest n . n_own over the faces of vertex i; (-1, -1) for an inner vertex."""
    out = wp.vec2(1.0, -1.0)
    for e in range(vs_start[i], vs_start[i + 1]):
        t = tris[vs_tri[e]]
        a = area_vector(x[t[0]], x[t[1]], x[t[2]])
        d = wp.dot(a, n) / wp.length(a)
        out = wp.vec2(wp.min(out[0], d), wp.max(out[1], d))
    if vs_start[i + 1] == vs_start[i]:
        return wp.vec2(-1.0, -1.0)
    return out


@wp.func
def looks_against(
    i: int,
    n: wp.vec3,
    tris: wp.array[wp.vec3i],
    vs_start: wp.array[int],
    vs_tri: wp.array[int],
    x: wp.array[wp.vec3],
) -> bool:
    """Whether a face of normal n opposes one of vertex i; always true for an inner vertex."""
    for e in range(vs_start[i], vs_start[i + 1]):
        t = tris[vs_tri[e]]
        a = area_vector(x[t[0]], x[t[1]], x[t[2]])
        if wp.dot(a, n) / wp.length(a) < -LEAN:
            return True
    return vs_start[i + 1] == vs_start[i]


@wp.func
def edge_looks(s: wp.vec3i, t: wp.vec3i, n: wp.vec3, x: wp.array[wp.vec3]) -> wp.vec2:
    """Least and largest n . n_own over the two triangles of an edge."""
    a = wp.dot(wp.normalize(area_vector(x[s[0]], x[s[1]], x[s[2]])), n)
    b = wp.dot(wp.normalize(area_vector(x[t[0]], x[t[1]], x[t[2]])), n)
    return wp.vec2(wp.min(a, b), wp.max(a, b))


@wp.func
def opposes(look: wp.vec2) -> bool:
    return look[0] < -LEAN


@wp.func
def along(look: wp.vec2) -> bool:
    return not opposes(look) and look[1] > ALONG


@wp.func
def closest_opposing(
    surface: wp.uint64,
    root: int,
    tris: wp.array[wp.vec3i],
    vs_start: wp.array[int],
    vs_tri: wp.array[int],
    x: wp.array[wp.vec3],
    i: int,
    reach: float,  # [m]
) -> Hit:
    """Closest point to vertex i on the faces that oppose it, within the reach."""
    best = Hit()
    best.tri = -1
    best.t = reach
    k = int(0)
    grow = wp.vec3(reach, reach, reach)
    query = wp.bvh_query_aabb(surface, x[i] - grow, x[i] + grow, root)
    while wp.bvh_query_next(query, k):
        found = closer(best, k, tris, x, x[i])
        if found.tri != best.tri:
            n = face_normal(tris[k], x)
            if looks_against(i, n, tris, vs_start, vs_tri, x):
                best = found
    return best
