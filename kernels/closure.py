"""Stage 4, the end: every colliding vertex into the plane of its triangle.

With D the overlap left at a contact and f the share that the side moving along n takes,

    x_k += f D a_k / sum a^2 n            the side that moves along n
    x_k += (1 - f) D a_k / sum a^2 n      the other side (a_k < 0)

each vertex averaging over its contacts with weights |a_k| (Jacobi). eq. (1) alone leaves 25 to 38 %
of an overlap between a vertex and the middle of a triangle. Positions move by at most a fraction of
an edge in one step: a body that starts deep inside another would be inverted at once.
"""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.kernel
def share_by_mass(
    # in
    n_contact: wp.array[int],  # (1,)
    vert: wp.array2d[int],  # (capacity, 5)
    coef: wp.array2d[float],  # (capacity, 5)
    inv_mass: wp.array[float],  # (n_vert,) [1/kg]
    # out
    share: wp.array[float],  # (capacity,)
):
    """One thread per contact: the lighter side moves more, the centre of mass stays."""
    c = wp.tid()
    if c >= n_contact[0]:
        return
    w = wp.vec2(0.0, 0.0)
    for k in range(5):
        a = coef[c, k]
        if a > 0.0:
            w[0] += a * a * inv_mass[vert[c, k]]
        else:
            w[1] += a * a * inv_mass[vert[c, k]]
    share[c] = 0.5
    if w[0] + w[1] > 0.0:
        share[c] = w[0] / (w[0] + w[1])


@wp.kernel
def share_by_fraction(
    # in
    n_contact: wp.array[int],  # (1,)
    left: wp.array[float],  # (capacity,) [m]
    upper: wp.array[wp.vec3],  # (capacity,) (., ., fraction) of the side that moves along n
    lower: wp.array[wp.vec3],  # (capacity,)
    # out
    share: wp.array[float],  # (capacity,)
):
    """One thread per contact: split as the search did."""
    c = wp.tid()
    if c >= n_contact[0] or left[c] <= 0.0:
        return
    up = upper[c][2]
    lo = lower[c][2]
    if lo < 0.0:
        share[c] = 1.0
    elif up < 0.0:
        share[c] = 0.0
    elif up + lo > 0.0:
        share[c] = up / (up + lo)


@wp.kernel
def close_gaps(
    # in
    bound: float,  # largest move in a step, in edges
    start: wp.array[int],  # (n_vert + 1,)
    entry: wp.array[int],  # (5 capacity,)
    vert: wp.array2d[int],  # (capacity, 5)
    coef: wp.array2d[float],  # (capacity, 5)
    normal: wp.array[wp.vec3],  # (capacity,)
    left: wp.array[float],  # (capacity,) [m]
    share: wp.array[float],  # (capacity,)
    inv_mass: wp.array[float],  # (n_vert,) [1/kg]
    vert_body: wp.array[int],  # (n_vert,)
    body_edge: wp.array[float],  # (n_body,) [m]
    x0: wp.array[wp.vec3],  # (n_vert,) [m] before stage 4
    # in, out
    x: wp.array[wp.vec3],  # (n_vert,) [m]
):
    """One thread per vertex: its weighted mean over the contacts with an overlap left."""
    i = wp.tid()
    if start[i] == start[i + 1] or inv_mass[i] == 0.0:
        return
    move = wp.vec3(0.0, 0.0, 0.0)
    weight = float(0.0)
    for e in range(start[i], start[i + 1]):
        c = entry[e] // 5
        a = coef[c, entry[e] - 5 * c]
        if left[c] > 0.0:
            f = share[c] if a > 0.0 else 1.0 - share[c]
            total = float(0.0)
            for k in range(5):
                if coef[c, k] * a > 0.0 and inv_mass[vert[c, k]] > 0.0:
                    total += coef[c, k] * coef[c, k]
            move += wp.abs(a) * (f * left[c] * a / total) * normal[c]
            weight += wp.abs(a)
    if weight == 0.0:
        return
    moved = x[i] + move / weight - x0[i]
    limit = bound * body_edge[vert_body[i]]
    size = wp.length(moved)
    if size > limit:
        moved = moved * (limit / size)
    x[i] = x0[i] + moved
