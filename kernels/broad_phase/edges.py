"""Edges and triangles that may come to cross: no axis separates them by more than both skins.

Threads append the pairs that they find to a list in any order; pairs.py sorts it.
"""

import warp as wp

from warp_contact.kernels.broad_phase.bounds import next_in
from warp_contact.kernels.broad_phase.near import MANY, Near, is_near, piece, reaches
from warp_contact.kernels.broad_phase.pairs import append
from warp_contact.kernels.geometry import NONE, boxes_meet
from warp_contact.kernels.mesh import Mesh
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

AXES = wp.constant(8)  # of a segment and a triangle: its normal, and products of directions


@wp.func
def gap_along(
    axis: wp.vec3, p: wp.vec3, q: wp.vec3, b: wp.vec3, c: wp.vec3
) -> float:  # relative to corner a of the triangle
    """Gap between pq and the triangle 0bc along an axis, not above 0 where they overlap."""
    size = wp.length(axis)
    if size == 0.0:
        return 0.0
    sp = wp.dot(axis, p)
    sq = wp.dot(axis, q)
    sb = wp.dot(axis, b)
    sc = wp.dot(axis, c)
    lo = wp.min(wp.min(sb, sc), 0.0)
    hi = wp.max(wp.max(sb, sc), 0.0)
    return wp.max(wp.min(sp, sq) - hi, lo - wp.max(sp, sq)) / size


@wp.func
def axis_of(k: int, d: wp.vec3, b: wp.vec3, c: wp.vec3) -> wp.vec3:
    """Axis k of a segment along d and the triangle 0bc: one of AXES that may separate them."""
    n = wp.cross(b, c)
    if k == 0:
        return n
    if k == 1:
        return wp.cross(n, d)
    e = b
    if k >= 4:
        e = c
    if k >= 6:
        e = c - b
    if k % 2 == 0:
        return wp.cross(d, e)
    return wp.cross(n, e)


@wp.struct
class Separation:
    axis: int  # of AXES
    gap: float  # [m] along it, not above 0 where they may cross


@wp.func
def separation(
    p: wp.vec3, q: wp.vec3, t: wp.vec3i, enough: float, x: wp.array[wp.vec3]
) -> Separation:
    """The axis with the largest gap between pq and triangle t, or the first beyond ``enough``."""
    a = x[t[0]]
    b = x[t[1]] - a
    c = x[t[2]] - a
    out = Separation()
    out.gap = -NONE
    for k in range(AXES):
        if out.gap <= enough:
            gap = gap_along(axis_of(k, q - p, b, c), p - a, q - a, b, c)
            if gap > out.gap:
                out.gap = gap
                out.axis = k
    return out


@wp.func
def gap_to(p: wp.vec3, q: wp.vec3, t: wp.vec3i, enough: float, x: wp.array[wp.vec3]) -> float:
    """Lower bound [m] on the distance of pq to triangle t, by the separating axis theorem.

    The gap along the first axis where it exceeds ``enough``, else the largest gap of all axes.
    """
    return separation(p, q, t, enough, x).gap


@wp.kernel
def visit_edges(
    # in
    skin: wp.array[float],  # (n_body,) [m]
    mesh: Mesh,
    of: Near,
    near_tri: wp.array[int],  # (capacity,) of near.py
    lower: wp.array[wp.vec3],  # (n_tri,) boxes of the triangles [m]
    upper: wp.array[wp.vec3],  # (n_tri,) [m]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    found: wp.array[wp.vec2i],  # (capacity,) edge and triangle
    # out, added to
    n_found: wp.array[int],  # (1,)
):
    """One thread per surface edge: the triangles that it may come to cross."""
    e = wp.tid()
    m = mesh.vert_body[mesh.edges[e][0]]
    if of.n_near[m] == 0:
        return
    p = x[mesh.edges[e][0]]
    q = x[mesh.edges[e][1]]
    own = piece(p, p, q, q, skin[m])
    if of.n_near[m] <= MANY:
        for k in range(of.n_near[m]):
            reach = skin[m] + skin[of.other[m, k]]
            if reaches(own, of.slab[m, k]):
                theirs = of.part[m, k]
                if boxes_meet(own.lo, own.hi, theirs.tri_lower, theirs.tri_upper):
                    for c in range(theirs.tris[0], theirs.tris[1]):
                        t = near_tri[c]
                        if boxes_meet(own.lo, own.hi, lower[t], upper[t]):
                            if gap_to(p, q, mesh.tris[t], reach, x) <= reach:
                                append(e, t, found, n_found)
    else:
        world = of.world[m]
        body = next_in(of.bodies, world, own.lo, own.hi, -1)
        while body >= 0:
            if is_near(m, body, own, of):
                reach = skin[m] + skin[body]
                t = int(0)
                root = wp.bvh_get_group_root(mesh.bvh, body)
                query = wp.bvh_query_aabb(mesh.bvh, own.lo, own.hi, root)
                while wp.bvh_query_next(query, t):
                    if gap_to(p, q, mesh.tris[t], reach, x) <= reach:
                        append(e, t, found, n_found)
            body = next_in(of.bodies, world, own.lo, own.hi, body)
