"""Stage 2, broad phase: which vertices may enter which tets of other bodies, by spatial hashing.

Teschner et al. 2003: cell (i, j, k) = floor(x / l), l the mean edge length, and
hash = (i 73856093 xor j 19349663 xor k 83492791) mod n. Here the body is hashed too, because a tet
looks for the vertices of one near body at a time. A counting sort inserts the vertices. Their true
cells are compared, so that a collision of hashes costs a comparison and nothing else. Each tet
visits the cells around it. The vertices that it finds within both skins (skins.py) go to pairs.py.
A half-space counts as a body with one tet.
"""

import warp as wp

from warp_contact.kernels.broad_phase.near import MANY, Near, any_near, is_near, piece, reaches
from warp_contact.kernels.broad_phase.pairs import append
from warp_contact.kernels.geometry import boxes_meet, in_box
from warp_contact.kernels.mesh import Mesh
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)


@wp.func
def cell_of(x: wp.vec3, size: float) -> wp.vec3i:
    return wp.vec3i(
        int(wp.floor(x[0] / size)), int(wp.floor(x[1] / size)), int(wp.floor(x[2] / size))
    )


@wp.func
def hash_of(cell: wp.vec3i, body: int, n: int) -> int:
    """Hash of a cell and a body."""
    h = wp.uint32(cell[0]) * wp.uint32(73856093)
    h = h ^ (wp.uint32(cell[1]) * wp.uint32(19349663))
    h = h ^ (wp.uint32(cell[2]) * wp.uint32(83492791))
    h = h ^ (wp.uint32(body) * wp.uint32(97531))
    return int(h % wp.uint32(n))


@wp.kernel
def count_cells(
    # in
    size: float,  # edge of a cell [m]
    skin: wp.array[float],  # (n_body,) [m]
    vert_body: wp.array[int],  # (n_vert,)
    of: Near,
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    key: wp.array[int],  # (n_vert,), -1 for a vertex that no other body may touch
    # out, added to
    count: wp.array[int],  # (n_cell + 1,)
):
    """One thread per vertex: hash its cell, and count the vertices with this hash."""
    i = wp.tid()
    m = vert_body[i]
    key[i] = -1
    if any_near(m, piece(x[i], x[i], x[i], x[i], skin[m]), of):
        h = hash_of(cell_of(x[i], size), m, count.shape[0] - 1)
        key[i] = h
        wp.atomic_add(count, h, 1)


@wp.kernel
def fill_cells(
    # in
    key: wp.array[int],  # (n_vert,)
    # in, out
    cell_start: wp.array[int],  # (n_cell + 1,) ends of the cells in, their starts out
    # out
    cell_vert: wp.array[int],  # (n_vert,)
):
    """One thread per vertex: put it into its cell, from the cell's end downwards."""
    i = wp.tid()
    if key[i] >= 0:
        cell_vert[wp.atomic_sub(cell_start, key[i], 1) - 1] = i


@wp.func
def beyond(axis: wp.vec3, x: wp.vec3, b: wp.vec3, c: wp.vec3, d: wp.vec3, reach: float) -> bool:
    """Whether x is further than the reach from the tet 0bcd along the axis."""
    sb = wp.dot(axis, b)
    sc = wp.dot(axis, c)
    sd = wp.dot(axis, d)
    s = wp.dot(axis, x)
    lo = wp.min(wp.min(sb, sc), wp.min(sd, 0.0))
    hi = wp.max(wp.max(sb, sc), wp.max(sd, 0.0))
    return wp.max(s - hi, lo - s) > reach * wp.length(axis)


@wp.func
def may_hold(x: wp.vec3, a: wp.vec3, b: wp.vec3, c: wp.vec3, d: wp.vec3, reach: float) -> bool:
    """Whether x is within the reach of the tet along all face normals; it may be inverted."""
    r = x - a
    e1 = b - a
    e2 = c - a
    e3 = d - a
    if beyond(wp.cross(e1, e2), r, e1, e2, e3, reach):
        return False
    if beyond(wp.cross(e2, e3), r, e1, e2, e3, reach):
        return False
    if beyond(wp.cross(e3, e1), r, e1, e2, e3, reach):
        return False
    return not beyond(wp.cross(e2 - e1, e3 - e1), r, e1, e2, e3, reach)


@wp.func
def visit_cells(
    q: int,
    m: int,
    size: float,
    lo: wp.vec3,
    hi: wp.vec3,
    reach: float,
    mesh: Mesh,
    cell_start: wp.array[int],
    cell_vert: wp.array[int],
    x: wp.array[wp.vec3],
    found: wp.array[wp.vec2i],
    n_found: wp.array[int],
):
    """Append the vertices of body m in the box from lo to hi that may enter tet q.

    If the box has more cells than the body has vertices, the vertices are tested one by one.
    """
    a = x[mesh.tets[q][0]]
    b = x[mesh.tets[q][1]]
    c = x[mesh.tets[q][2]]
    d = x[mesh.tets[q][3]]
    n = (hi - lo) / size + wp.vec3(1.0, 1.0, 1.0)
    if not n[0] * n[1] * n[2] <= float(mesh.body_vert[m + 1] - mesh.body_vert[m]):  # or not finite
        for i in range(mesh.body_vert[m], mesh.body_vert[m + 1]):
            if in_box(x[i], lo, hi) and may_hold(x[i], a, b, c, d, reach):
                append(i, q, found, n_found)
        return
    first = cell_of(lo, size)
    last = cell_of(hi, size)
    for ci in range(first[0], last[0] + 1):
        for cj in range(first[1], last[1] + 1):
            for ck in range(first[2], last[2] + 1):
                cell = wp.vec3i(ci, cj, ck)
                h = hash_of(cell, m, cell_start.shape[0] - 1)
                for e in range(cell_start[h], cell_start[h + 1]):
                    i = cell_vert[e]
                    if mesh.vert_body[i] == m and in_box(x[i], lo, hi):
                        if cell_of(x[i], size) == cell and may_hold(x[i], a, b, c, d, reach):
                            append(i, q, found, n_found)


@wp.kernel
def visit_tets(
    # in
    size: float,  # edge of a cell [m]
    skin: wp.array[float],  # (n_body,) [m]
    mesh: Mesh,
    of: Near,
    cell_start: wp.array[int],  # (n_cell + 1,)
    cell_vert: wp.array[int],  # (n_vert,)
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    found: wp.array[wp.vec2i],  # (capacity,) vertex and tet
    # out, added to
    n_found: wp.array[int],  # (1,)
):
    """One thread per tet: the vertices of other bodies that may enter it."""
    q = wp.tid()
    m = mesh.vert_body[mesh.tets[q][0]]
    if of.n_near[m] == 0:
        return
    t = mesh.tets[q]
    own = piece(x[t[0]], x[t[1]], x[t[2]], x[t[3]], skin[m])
    if of.n_near[m] <= MANY:
        for k in range(of.n_near[m]):
            if reaches(own, of.slab[m, k]):
                theirs = of.part[m, k]
                if boxes_meet(own.lo, own.hi, theirs.vert_lower, theirs.vert_upper):
                    body = of.other[m, k]
                    grow = wp.vec3(skin[body], skin[body], skin[body])
                    lo = wp.max(own.lo - grow, theirs.vert_lower)
                    hi = wp.min(own.hi + grow, theirs.vert_upper)
                    reach = skin[m] + skin[body]
                    visit_cells(
                        q, body, size, lo, hi, reach, mesh, cell_start, cell_vert, x, found, n_found
                    )
    else:
        body = int(0)
        root = wp.bvh_get_group_root(of.bodies, of.world[m])
        query = wp.bvh_query_aabb(of.bodies, own.lo, own.hi, root)
        while wp.bvh_query_next(query, body):
            if is_near(m, body, own, of):
                grow = wp.vec3(skin[body], skin[body], skin[body])
                lo = wp.max(own.lo - grow, of.lower[body])
                hi = wp.min(own.hi + grow, of.upper[body])
                reach = skin[m] + skin[body]
                visit_cells(
                    q, body, size, lo, hi, reach, mesh, cell_start, cell_vert, x, found, n_found
                )


@wp.kernel
def visit_planes(
    # in
    n_tet: int,
    skin: wp.array[float],  # (n_body,) [m]
    awake: wp.array[int],  # (n_body,)
    surf: wp.array[int],  # (n_surf,)
    vert_body: wp.array[int],  # (n_vert,)
    plane_n: wp.array[wp.vec3],  # (n_plane,)
    plane_h: wp.array[float],  # (n_plane,) [m]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    found: wp.array[wp.vec2i],  # (capacity,) vertex and n_tet + p for plane p
    # out, added to
    n_found: wp.array[int],  # (1,)
):
    """One thread per surface vertex: the planes that it may pass."""
    i = surf[wp.tid()]
    if awake[vert_body[i]] == 0:
        return
    for p in range(plane_n.shape[0]):
        if wp.dot(plane_n[p], x[i]) < plane_h[p] + skin[vert_body[i]]:
            append(i, n_tet + p, found, n_found)
