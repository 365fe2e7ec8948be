"""Stage 3: the overlap that is left, and where each surface vertex would go to resolve it.

    g_c = (sum a_k x_k) . n - offset,  d_c = max(0, -g_c)                               [m]

Displacement vector of a vertex, eq. (1) of Spillmann & Teschner 2005. Its own penetration vector d
points out of the other body; the vectors d_i of the vertices whose contact triangle it belongs to
push it the other way, hence the minus sign (as printed the two would cancel):

    s = (d - sum w_i d_i) / (sum w_i + 1)                                               [m]
"""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.kernel
def leftover(
    # in
    tolerance: float,  # of an edge; less is not worth a displacement
    n_contact: wp.array[int],  # (1,)
    vert: wp.array2d[int],  # (capacity, 5)
    coef: wp.array2d[float],  # (capacity, 5)
    normal: wp.array[wp.vec3],  # (capacity,)
    offset: wp.array[float],  # (capacity,) [m]
    pair: wp.array[wp.vec2i],  # (capacity,)
    body_edge: wp.array[float],  # (n_body,) [m]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    left: wp.array[float],  # (capacity,) [m]
    # out, added to
    found: wp.array[int],  # (1,) 1 when any overlap is above the tolerance
):
    """One thread per contact: the overlap at x."""
    c = wp.tid()
    if c >= n_contact[0]:
        return
    # Differences to the first vertex keep float32 exact far from the origin.
    origin = x[vert[c, 0]]
    gap = wp.vec3(0.0, 0.0, 0.0)
    active = float(0.0)
    for k in range(5):
        gap += coef[c, k] * (x[vert[c, k]] - origin)
        active += wp.abs(coef[c, k])
    g = wp.dot(gap, normal[c])
    if pair[c][1] >= body_edge.shape[0]:  # a plane
        g = wp.dot(origin, normal[c]) - offset[c]
    d = float(0.0)
    if active > 0.0:
        d = wp.max(-g, 0.0)
    left[c] = d
    if d > tolerance * body_edge[pair[c][0]]:
        found[0] = 1


@wp.kernel
def displacement_vectors(
    # in
    start: wp.array[int],  # (n_vert + 1,)
    entry: wp.array[int],  # (5 capacity,)
    coef: wp.array2d[float],  # (capacity, 5)
    normal: wp.array[wp.vec3],  # (capacity,)
    left: wp.array[float],  # (capacity,) [m]
    inv_mass: wp.array[float],  # (n_vert,) [1/kg]
    # out
    s: wp.array[wp.vec3],  # (n_vert,) [m], zero outside the region
):
    """One thread per vertex: eq. (1); an edge's end counts with its weight on the edge."""
    i = wp.tid()
    s[i] = wp.vec3(0.0, 0.0, 0.0)
    if inv_mass[i] == 0.0:
        return
    own = wp.vec3(0.0, 0.0, 0.0)
    own_weight = float(0.0)
    others = wp.vec3(0.0, 0.0, 0.0)
    others_weight = float(0.0)
    for e in range(start[i], start[i + 1]):
        c = entry[e] // 5
        a = coef[c, entry[e] - 5 * c]
        if left[c] > 0.0:
            d = left[c] * normal[c]
            if a > 0.0:
                own += a * d
                own_weight += a
            else:
                others -= a * d
                others_weight -= a
    if own_weight > 1.0:
        own = own / own_weight
    s[i] = (own - others) / (others_weight + 1.0)


@wp.kernel
def touching_tets(
    # in
    tets: wp.array[wp.vec4i],  # (n_tet,)
    s: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    mask: wp.array[int],  # (n_tet,) 1 for a tet with a displacement vertex
):
    """One thread per tet: only these see their forces change during the search."""
    q = wp.tid()
    mask[q] = 0
    for k in range(4):
        if wp.length_sq(s[tets[q][k]]) > 0.0:
            mask[q] = 1
