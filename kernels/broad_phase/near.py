"""The bodies that may touch a body, and which of their parts may.

Two bodies are near each other if their boxes meet, and if they also meet when projected on the
line through the centres of the boxes. The projection of a body is its slab. Of each near body, the
vertices and triangles that reach into the slab of the other one are boxed, and the triangles are
listed. In a pile, they are a cap of the body. A body with more than MANY near bodies, such as the
floor of a pile, has no list: its parts query the Bvh over the bodies.
"""

import warp as wp

from warp_contact.kernels.broad_phase.pairs import all_fit
from warp_contact.kernels.geometry import boxes_meet
from warp_contact.kernels.mesh import Mesh
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

MANY = wp.constant(32)  # near bodies in a list, at most
LARGE = wp.constant(512)  # vertices; a larger body is represented by its box
EXPLODED = wp.constant(1.0e5)  # cells along a body; a longer one has exploded


@wp.func
def box_support(axis: wp.vec3, lo: wp.vec3, hi: wp.vec3) -> float:
    """Largest coordinate of a box along an axis [m]."""
    return wp.dot(0.5 * (lo + hi), axis) + wp.dot(0.5 * (hi - lo), wp.abs(axis))


@wp.func
def support(
    body: int,
    axis: wp.vec3,
    skin: float,
    body_vert: wp.array[int],
    lower: wp.array[wp.vec3],
    upper: wp.array[wp.vec3],
    x: wp.array[wp.vec3],
) -> float:
    """Largest coordinate of a body and its skin along a unit axis [m], or an upper bound."""
    if body_vert[body + 1] - body_vert[body] > LARGE:
        return box_support(axis, lower[body], upper[body])
    s = float(-1.0e30)
    for i in range(body_vert[body], body_vert[body + 1]):
        s = wp.max(s, wp.dot(x[i], axis))
    return s + skin


@wp.kernel
def near_bodies(
    # in
    cell: float,  # [m]
    skin: wp.array[float],  # (n_body,) [m]
    bodies: wp.uint64,  # Bvh over the boxes, grouped by world
    world: wp.array[int],  # (n_body,)
    body_vert: wp.array[int],  # (n_body + 1,)
    awake: wp.array[int],  # (n_body,)
    lower: wp.array[wp.vec3],  # (n_body,) [m]
    upper: wp.array[wp.vec3],  # (n_body,) [m]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    n_near: wp.array[int],  # (n_body,), MANY + 1 for a body without a list
    listed: wp.array2d[int],  # (n_body, MANY) near bodies, ascending
    slab: wp.array2d[wp.vec4],  # (n_body, MANY) axis towards the near body, its begin along it [m]
    end: wp.array2d[float],  # (n_body, MANY) where body m ends along the axis [m]
    # out, added to
    any_pair: wp.array[int],  # (1,) 1 when any body is near another
):
    """One thread per body: list the bodies of its world that may touch it, if either is awake."""
    m = wp.tid()
    n_near[m] = 0
    # A body that has exploded gets no contacts: the loop over its cells would not end.
    if not wp.length(upper[m] - lower[m]) < EXPLODED * cell:
        return
    count = int(0)
    other = int(0)
    query = wp.bvh_query_aabb(bodies, lower[m], upper[m], wp.bvh_get_group_root(bodies, world[m]))
    while wp.bvh_query_next(query, other):
        if count <= MANY and other != m and awake[m] + awake[other] > 0:
            if boxes_meet(lower[m], upper[m], lower[other], upper[other]):
                axis = wp.normalize((lower[other] + upper[other]) - (lower[m] + upper[m]))
                begin = -support(other, -axis, skin[other], body_vert, lower, upper, x)
                last = support(m, axis, skin[m], body_vert, lower, upper, x)
                if last >= begin:
                    if count < MANY:
                        k = int(count)
                        while k > 0 and listed[m, wp.max(k - 1, 0)] > other:
                            listed[m, k] = listed[m, k - 1]
                            slab[m, k] = slab[m, k - 1]
                            end[m, k] = end[m, k - 1]
                            k -= 1
                        listed[m, k] = other
                        slab[m, k] = wp.vec4(axis[0], axis[1], axis[2], begin)
                        end[m, k] = last
                    count += 1
    n_near[m] = count
    if count > 0:
        any_pair[0] = 1


@wp.struct
class Piece:
    """A piece of a body: its corners, its skin, and the box around both."""

    a: wp.vec3
    b: wp.vec3
    c: wp.vec3
    d: wp.vec3
    lo: wp.vec3
    hi: wp.vec3
    skin: float


@wp.func
def piece(a: wp.vec3, b: wp.vec3, c: wp.vec3, d: wp.vec3, skin: float) -> Piece:
    out = Piece()
    out.a = a
    out.b = b
    out.c = c
    out.d = d
    out.lo = wp.min(wp.min(a, b), wp.min(c, d)) - wp.vec3(skin, skin, skin)
    out.hi = wp.max(wp.max(a, b), wp.max(c, d)) + wp.vec3(skin, skin, skin)
    out.skin = skin
    return out


@wp.func
def reaches(p: Piece, slab: wp.vec4) -> bool:
    """Whether a corner is in the slab of a near body."""
    n = wp.vec3(slab[0], slab[1], slab[2])
    s = wp.max(wp.max(wp.dot(n, p.a), wp.dot(n, p.b)), wp.max(wp.dot(n, p.c), wp.dot(n, p.d)))
    return s + p.skin >= slab[3]


@wp.struct
class NearPart:
    """The part of a near body that reaches into the slab of body m."""

    vert_lower: wp.vec3  # box of the vertices [m]
    vert_upper: wp.vec3
    tri_lower: wp.vec3  # box of the triangles [m]
    tri_upper: wp.vec3
    tris: wp.vec2i  # first and end of these triangles in ``near_tri``


@wp.struct
class Near:
    """The bodies near each body; lists have the shape (n_body, MANY)."""

    bodies: wp.uint64  # Bvh over the boxes, grouped by world
    world: wp.array[int]  # (n_body,)
    lower: wp.array[wp.vec3]  # (n_body,) boxes of the bodies [m]
    upper: wp.array[wp.vec3]  # (n_body,)
    n_near: wp.array[int]  # (n_body,) MANY + 1 for a body without a list
    other: wp.array2d[int]  # these bodies, ascending
    slab: wp.array2d[wp.vec4]  # axis towards the near body, its begin along it [m]
    end: wp.array2d[float]  # where body m ends along it [m]
    part: wp.array2d[NearPart]  # of the near body, as far as body m reaches


@wp.kernel
def near_parts(
    # in
    skin: wp.array[float],  # (n_body,) [m]
    mesh: Mesh,
    of: Near,  # without the parts
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    part_of: wp.array2d[NearPart],  # (n_body, MANY)
    near_tri: wp.array[int],  # (capacity,)
    # out, added to
    count: wp.array[int],  # (1,)
):
    """One thread per entry of the lists: its part. Triangles that do not fit are only counted."""
    m, k = wp.tid()
    if of.n_near[m] > MANY or k >= of.n_near[m]:
        return
    body = of.other[m, k]
    s = of.slab[m, k]
    back = wp.vec4(-s[0], -s[1], -s[2], -of.end[m, k])
    own = skin[body]
    grow = wp.vec3(own, own, own)
    lo = wp.vec3(1.0e30, 1.0e30, 1.0e30)
    hi = -lo
    if mesh.body_vert[body + 1] - mesh.body_vert[body] > LARGE:
        lo = of.lower[body]
        hi = of.upper[body]
    else:
        for i in range(mesh.body_vert[body], mesh.body_vert[body + 1]):
            if reaches(piece(x[i], x[i], x[i], x[i], own), back):
                lo = wp.min(lo, x[i] - grow)
                hi = wp.max(hi, x[i] + grow)
    out = NearPart()
    out.vert_lower = lo
    out.vert_upper = hi
    lo = wp.vec3(1.0e30, 1.0e30, 1.0e30)
    hi = -lo
    root = wp.bvh_get_group_root(mesh.bvh, body)
    first = int(0)
    for fill in range(2):
        n = int(0)
        t = int(0)
        query = wp.bvh_query_aabb(mesh.bvh, of.lower[m], of.upper[m], root)
        while wp.bvh_query_next(query, t):
            c = x[mesh.tris[t][2]]
            p = piece(x[mesh.tris[t][0]], x[mesh.tris[t][1]], c, c, own)
            if reaches(p, back):
                if fill == 1:
                    near_tri[first + n] = t
                lo = wp.min(lo, p.lo)
                hi = wp.max(hi, p.hi)
                n += 1
        if fill == 0:
            out.tri_lower = lo
            out.tri_upper = hi
            first = wp.atomic_add(count, 0, n)
            if first < 0 or n > near_tri.shape[0] - first:  # as ``append`` of pairs.py
                part_of[m, k] = out
                return
            out.tris = wp.vec2i(first, first + n)
            part_of[m, k] = out


@wp.kernel
def fits(
    # in
    capacity: int,
    # in, out
    count: wp.array[int],  # (1,) 0 on return
    # out, added to
    needed: wp.array[int],  # (1,) largest number that did not fit
):
    """One thread: report the count if it did not fit, and reset it."""
    all_fit(count[0], capacity, needed)
    count[0] = 0


@wp.func
def is_near(m: int, body: int, p: Piece, of: Near) -> bool:
    """Whether a piece of body m, which has no list, may touch another body."""
    if body == m or of.n_near[body] == 0:
        return False
    return boxes_meet(p.lo, p.hi, of.lower[body], of.upper[body])


@wp.func
def any_near(m: int, p: Piece, of: Near) -> bool:
    """Whether a piece of body m may touch another body."""
    if of.n_near[m] <= MANY:
        for k in range(of.n_near[m]):
            body = of.other[m, k]
            if reaches(p, of.slab[m, k]) and boxes_meet(p.lo, p.hi, of.lower[body], of.upper[body]):
                return True
        return False
    other = int(0)
    root = wp.bvh_get_group_root(of.bodies, of.world[m])
    query = wp.bvh_query_aabb(of.bodies, p.lo, p.hi, root)
    while wp.bvh_query_next(query, other):
        if is_near(m, other, p, of):
            return True
    return False
