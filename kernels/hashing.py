"""Stage 1: which vertices lie inside tets of other bodies, by spatial hashing.

Teschner et al. 2003: cell (i, j, k) = floor(x / l), l the mean edge length, and
hash = (i 73856093 xor j 19349663 xor k 83492791) mod n. Vertices are inserted by a counting sort,
with their true cell, so that a collision of hashes costs a comparison and nothing else. Each tet
then visits the cells that it shares with the box of each near body. A vertex keeps the ids of
the bodies it is inside of in a few slots, sorted afterwards: the order of threads leaves no trace.
"""

import warp as wp

from warp_contact.kernels.geometry import boxes_meet, in_box, tet_weights

wp.set_module_options({"enable_backward": False})

# A vertex this little outside of a tet, in barycentric weights, counts as inside: where two rims
# lie flush, rounding would else let corners slip past each other. Less than the resting gap.
SKIN = wp.constant(0.0)


@wp.func
def cell_of(x: wp.vec3, size: float) -> wp.vec3i:
    return wp.vec3i(
        int(wp.floor(x[0] / size)), int(wp.floor(x[1] / size)), int(wp.floor(x[2] / size))
    )


@wp.func
def hash_of(cell: wp.vec3i, world: int, n: int) -> int:
    """Hash of a cell; worlds are mixed in so that copies of a scene do not share cells."""
    h = wp.uint32(cell[0]) * wp.uint32(73856093)
    h = h ^ (wp.uint32(cell[1]) * wp.uint32(19349663))
    h = h ^ (wp.uint32(cell[2]) * wp.uint32(83492791))
    h = h ^ (wp.uint32(world) * wp.uint32(97531))
    return int(h % wp.uint32(n))


@wp.kernel
def count_cells(
    # in
    size: float,  # edge of a cell [m]
    vert_body: wp.array[int],  # (n_vert,)
    world: wp.array[int],  # (n_body,)
    n_near: wp.array[int],  # (n_body,)
    near: wp.array2d[int],  # (n_body, capacity)
    lower: wp.array[wp.vec3],  # (n_body,) [m]
    upper: wp.array[wp.vec3],  # (n_body,) [m]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    key: wp.array[int],  # (n_vert,), -1 for a vertex that is in no other body's box
    # out, added to
    count: wp.array[int],  # (n_cell + 1,)
):
    """One thread per vertex: its cell's hash, counted."""
    i = wp.tid()
    m = vert_body[i]
    key[i] = -1
    for k in range(n_near[m]):
        if in_box(x[i], lower[near[m, k]], upper[near[m, k]]):
            h = hash_of(cell_of(x[i], size), world[m], count.shape[0] - 1)
            key[i] = h
            wp.atomic_add(count, h, 1)
            return


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
def enter(i: int, body: int, slots: int, inside: wp.array[int], needed: wp.array[int]):
    """Note that vertex i is inside a body, once."""
    for k in range(slots):
        seen = wp.atomic_cas(inside, slots * i + k, -1, body)
        if seen == -1 or seen == body:
            return
    wp.atomic_max(needed, 0, slots + 1)


@wp.kernel
def find_inside(
    # in
    size: float,  # edge of a cell [m]
    slots: int,  # of each vertex
    tets: wp.array[wp.vec4i],  # (n_tet,)
    vert_body: wp.array[int],  # (n_vert,)
    world: wp.array[int],  # (n_body,)
    n_near: wp.array[int],  # (n_body,)
    near: wp.array2d[int],  # (n_body, capacity)
    lower: wp.array[wp.vec3],  # (n_body,) [m]
    upper: wp.array[wp.vec3],  # (n_body,) [m]
    cell_start: wp.array[int],  # (n_cell + 1,)
    cell_vert: wp.array[int],  # (n_vert,)
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # in, out
    inside: wp.array[int],  # (n_vert * slots,) bodies, -1 where free
    needed: wp.array[int],  # slots that would have been enough
):
    """One thread per tet: enter its body into the slots of the vertices it holds."""
    q = wp.tid()
    body = vert_body[tets[q][0]]
    if n_near[body] == 0:
        return
    a = x[tets[q][0]]
    b = x[tets[q][1]]
    c = x[tets[q][2]]
    d = x[tets[q][3]]
    tlo = wp.min(wp.min(a, b), wp.min(c, d))
    thi = wp.max(wp.max(a, b), wp.max(c, d))
    for k in range(n_near[body]):
        m = near[body, k]
        if boxes_meet(tlo, thi, lower[m], upper[m]):
            first = cell_of(wp.max(tlo, lower[m]), size)
            last = cell_of(wp.min(thi, upper[m]), size)
            for ci in range(first[0], last[0] + 1):
                for cj in range(first[1], last[1] + 1):
                    for ck in range(first[2], last[2] + 1):
                        cell = wp.vec3i(ci, cj, ck)
                        h = hash_of(cell, world[body], cell_start.shape[0] - 1)
                        for e in range(cell_start[h], cell_start[h + 1]):
                            i = cell_vert[e]
                            if vert_body[i] == m and in_box(x[i], tlo, thi):
                                if cell_of(x[i], size) == cell:
                                    w = tet_weights(x[i], a, b, c, d)
                                    if wp.min(w) >= -SKIN:
                                        enter(i, body, slots, inside, needed)


@wp.func
def is_inside(i: int, body: int, slots: int, inside: wp.array[int]) -> bool:
    for k in range(slots):
        if inside[slots * i + k] == body:
            return True
    return False


@wp.kernel
def count_hits(
    # in
    slots: int,  # of each vertex
    on_surface: wp.array[int],  # (n_vert,)
    plane_n: wp.array[wp.vec3],  # (n_plane,)
    plane_h: wp.array[float],  # (n_plane,) [m]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # in, out
    inside: wp.array[int],  # (n_vert * slots,) sorted on return, free slots last
    # out
    count: wp.array[int],  # (n_vert + 1,)
):
    """One thread per vertex: sort its slots, count its bodies and the planes it is below of."""
    i = wp.tid()
    n = int(0)
    for k in range(slots):
        body = inside[slots * i + k]
        if body >= 0:
            j = int(n)
            while j > 0 and inside[slots * i + wp.max(j - 1, 0)] > body:
                inside[slots * i + j] = inside[slots * i + j - 1]
                j -= 1
            inside[slots * i + j] = body
            n += 1
    if on_surface[i] == 1:
        for p in range(plane_n.shape[0]):
            if wp.dot(plane_n[p], x[i]) < plane_h[p]:
                n += 1
    count[i] = n


@wp.kernel
def list_hits(
    # in
    slots: int,  # of each vertex
    n_body: int,
    on_surface: wp.array[int],  # (n_vert,)
    plane_n: wp.array[wp.vec3],  # (n_plane,)
    plane_h: wp.array[float],  # (n_plane,) [m]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    inside: wp.array[int],  # (n_vert * slots,)
    hit_start: wp.array[int],  # (n_vert + 1,)
    # out
    hit_vert: wp.array[int],  # (capacity,)
    hit_body: wp.array[int],  # (capacity,) n_body + p for plane p
    hit_layer: wp.array[int],  # (capacity,) -1: no depth yet
):
    """One thread per vertex: write its hits, bodies in ascending order, then planes."""
    i = wp.tid()
    e = hit_start[i]
    last = wp.min(hit_start[i + 1], hit_vert.shape[0])
    if e >= last:
        return
    for k in range(slots):
        if e < last and inside[slots * i + k] >= 0:
            hit_vert[e] = i
            hit_body[e] = inside[slots * i + k]
            hit_layer[e] = -1
            e += 1
    if on_surface[i] == 1:
        for p in range(plane_n.shape[0]):
            if e < last and wp.dot(plane_n[p], x[i]) < plane_h[p]:
                hit_vert[e] = i
                hit_body[e] = n_body + p
                hit_layer[e] = 0
                e += 1
