"""Stage 4, the end: every colliding vertex into the plane of its triangle.

The impulses of stage 5 once more, on positions instead of velocities and with gaps as targets.
With e_k the mobility of vertex k in contact c and N_k the contacts that share it,

    W = sum a_k^2 N_k e_k,   p <- max(0, p - (g + slack) / W),   x_k += a_k e_k dp n

Mobilities are 1 / m: the centre of mass of a contact stays where it is. Where the search ran, those
of the two sides are scaled so that the sides share the overlap as the search did. Eq. (1) alone
leaves 25 to 38 % of an overlap between a vertex and the middle of a triangle.

A move p n of a pair that slides by u_t changes the angular momentum by p n x u_t. It is handed back
to the velocities as the couple of impulse.py, dv_k = (b_k . p u_t) n / m_k; where the search has
scaled the mobilities, momentum is not kept by design and nothing is handed back.

slack is what exceeds the largest move of a step, less the resting gap of the impulses: a body that
starts deep inside another would be inverted by a full correction.
"""

import warp as wp

from warp_contact.kernels.impulse import REST, gap

wp.set_module_options({"enable_backward": False})


@wp.kernel
def leftover(
    # in
    tolerance: float,  # of an edge; less is not worth a move
    deep: float,  # of an edge; less at the start of the step is not worth a search
    n_contact: wp.array[int],  # (1,)
    vert: wp.array2d[int],  # (capacity, 5)
    coef: wp.array2d[float],  # (capacity, 5)
    normal: wp.array[wp.vec3],  # (capacity,)
    offset: wp.array[float],  # (capacity,) [m]
    pair: wp.array[wp.vec2i],  # (capacity,)
    body_edge: wp.array[float],  # (n_body,) [m]
    closing: wp.array[float],  # (capacity,) [m/s] gap at the start of the step / dt
    dt: wp.array[float],  # (1,) [s]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    left: wp.array[float],  # (capacity,) [m]
    # out, added to
    found: wp.array[int],  # (2,) 1 when any overlap is to be closed, and to be searched
    deep_found: wp.array[int],  # (1,) 1 when any has been to be searched since the frame began
):
    """One thread per contact: the overlap at x."""
    c = wp.tid()
    if c >= n_contact[0]:
        return
    left[c] = 0.0
    if wp.length_sq(normal[c]) == 0.0:
        return
    d = -gap(c, vert, coef, normal, offset, pair[c][1] >= body_edge.shape[0], x)
    edge = body_edge[pair[c][0]]
    left[c] = wp.max(d, 0.0)
    if d > tolerance * edge:
        found[0] = 1
    if d > deep * edge and -closing[c] * dt[0] > deep * edge:
        found[1] = 1
        deep_found[0] = 1


@wp.kernel
def begin_closure(
    # in
    bound: float,  # largest move in a step, in edges
    n_contact: wp.array[int],  # (1,)
    pair: wp.array[wp.vec2i],  # (capacity,)
    body_edge: wp.array[float],  # (n_body,) [m]
    left: wp.array[float],  # (capacity,) [m]
    # out
    slack: wp.array[float],  # (capacity,) [m]
    scale: wp.array[wp.vec2],  # (capacity,) of the mobilities of both sides
    push: wp.array[float],  # (capacity,) [kg m]
):
    """One thread per contact: what stays for later steps."""
    c = wp.tid()
    if c >= n_contact[0]:
        return
    edge = body_edge[pair[c][0]]
    slack[c] = wp.max(left[c] - bound * edge, 0.0) - REST * edge
    scale[c] = wp.vec2(1.0, 1.0)
    push[c] = 0.0


@wp.func
def mobilities(
    c: int,
    vert: wp.array2d[int],
    coef: wp.array2d[float],
    start: wp.array[int],
    inv_mass: wp.array[float],
) -> wp.vec2:
    """W of the side that moves along the normal, and of the other [1/kg]."""
    w = wp.vec2(0.0, 0.0)
    for k in range(5):
        i = vert[c, k]
        part = coef[c, k] * coef[c, k] * float(start[i + 1] - start[i]) * inv_mass[i]
        if k < 2:
            w[0] += part
        else:
            w[1] += part
    return w


@wp.kernel
def share_as_found(
    # in
    deep: float,  # of an edge; less at the start of the step keeps the shares of the masses
    n_contact: wp.array[int],  # (1,)
    vert: wp.array2d[int],  # (capacity, 5)
    coef: wp.array2d[float],  # (capacity, 5)
    pair: wp.array[wp.vec2i],  # (capacity,)
    start: wp.array[int],  # (n_vert + 1,)
    inv_mass: wp.array[float],  # (n_vert,) [1/kg]
    body_edge: wp.array[float],  # (n_body,) [m]
    closing: wp.array[float],  # (capacity,) [m/s] gap at the start of the step / dt
    dt: wp.array[float],  # (1,) [s]
    upper: wp.array[wp.vec3],  # (capacity,) (., ., fraction) of the side that moves along n
    lower: wp.array[wp.vec3],  # (capacity,)
    # out
    scale: wp.array[wp.vec2],  # (capacity,)
):
    """One thread per contact: scale the mobilities to the fractions of the search."""
    c = wp.tid()
    if c >= n_contact[0] or -closing[c] * dt[0] <= deep * body_edge[pair[c][0]]:
        return
    w = mobilities(c, vert, coef, start, inv_mass)
    total = upper[c][2] + lower[c][2]
    if w[0] > 0.0 and w[1] > 0.0 and upper[c][2] >= 0.0 and lower[c][2] >= 0.0 and total > 0.0:
        f = upper[c][2] / total
        scale[c] = wp.vec2(f * (w[0] + w[1]) / w[0], (1.0 - f) * (w[0] + w[1]) / w[1])


@wp.kernel
def solve_gaps(
    # in
    tolerance: float,  # of an edge
    n_body: int,
    passes: int,  # at most
    n_contact: wp.array[int],  # (1,)
    vert: wp.array2d[int],  # (capacity, 5)
    coef: wp.array2d[float],  # (capacity, 5)
    normal: wp.array[wp.vec3],  # (capacity,)
    offset: wp.array[float],  # (capacity,) [m]
    pair: wp.array[wp.vec2i],  # (capacity,)
    start: wp.array[int],  # (n_vert + 1,)
    inv_mass: wp.array[float],  # (n_vert,) [1/kg]
    body_edge: wp.array[float],  # (n_body,) [m]
    slack: wp.array[float],  # (capacity,) [m]
    scale: wp.array[wp.vec2],  # (capacity,)
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    done: wp.array[int],  # (1,) passes so far
    # in, out
    push: wp.array[float],  # (capacity,) [kg m]
    # out
    change: wp.array[wp.vec3],  # (capacity,) [kg m]
    # out, added to
    again: wp.array[int],  # (1,) 1 when a gap is still open
):
    """One thread per contact: what this pass adds to its push."""
    c = wp.tid()
    if c >= n_contact[0]:
        return
    change[c] = wp.vec3(0.0, 0.0, 0.0)
    w = mobilities(c, vert, coef, start, inv_mass)
    total = w[0] * scale[c][0] + w[1] * scale[c][1]
    if total <= 0.0:
        return
    g = gap(c, vert, coef, normal, offset, pair[c][1] >= n_body, x) + slack[c]
    if g < -tolerance * body_edge[pair[c][0]] and done[0] < passes:
        again[0] = 1
    p = wp.max(push[c] - g / total, 0.0)
    change[c] = (p - push[c]) * normal[c]
    push[c] = p


@wp.kernel
def close_gaps(
    # in
    start: wp.array[int],  # (n_vert + 1,)
    entry: wp.array[int],  # (5 capacity,)
    coef: wp.array2d[float],  # (capacity, 5)
    scale: wp.array[wp.vec2],  # (capacity,)
    change: wp.array[wp.vec3],  # (capacity,) [kg m]
    inv_mass: wp.array[float],  # (n_vert,) [1/kg]
    # in, out
    x: wp.array[wp.vec3],  # (n_vert,) [m]
):
    """One thread per vertex: gather the moves of its contacts in their order."""
    i = wp.tid()
    if start[i] == start[i + 1] or inv_mass[i] == 0.0:
        return
    p = wp.vec3(0.0, 0.0, 0.0)
    for e in range(start[i], start[i + 1]):
        c = entry[e] // 5
        k = entry[e] - 5 * c
        side = scale[c][0]
        if k >= 2:
            side = scale[c][1]
        p += coef[c, k] * side * change[c]
    x[i] = x[i] + inv_mass[i] * p


@wp.kernel
def couples(
    # in
    n_contact: wp.array[int],  # (1,)
    vert: wp.array2d[int],  # (capacity, 5)
    coef: wp.array2d[float],  # (capacity, 5)
    scale: wp.array[wp.vec2],  # (capacity,)
    push: wp.array[float],  # (capacity,) [kg m]
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    # out
    change: wp.array[wp.vec3],  # (capacity,) [kg m^2/s] p u
):
    """One thread per contact: the couple that its push leaves behind."""
    c = wp.tid()
    if c >= n_contact[0]:
        return
    change[c] = wp.vec3(0.0, 0.0, 0.0)
    if push[c] == 0.0 or scale[c][0] != 1.0:
        return
    u = wp.vec3(0.0, 0.0, 0.0)
    for k in range(5):
        u += coef[c, k] * v[vert[c, k]]
    change[c] = push[c] * u


@wp.kernel
def hand_back(
    # in
    start: wp.array[int],  # (n_vert + 1,)
    entry: wp.array[int],  # (5 capacity,)
    normal: wp.array[wp.vec3],  # (capacity,)
    turn: wp.array2d[wp.vec3],  # (capacity, 5) [1/m]
    change: wp.array[wp.vec3],  # (capacity,) [kg m^2/s]
    inv_mass: wp.array[float],  # (n_vert,) [1/kg]
    # in, out
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
):
    """One thread per vertex: gather its part of the couples."""
    i = wp.tid()
    if start[i] == start[i + 1] or inv_mass[i] == 0.0:
        return
    p = wp.vec3(0.0, 0.0, 0.0)
    for e in range(start[i], start[i + 1]):
        c = entry[e] // 5
        p += wp.dot(turn[c, entry[e] - 5 * c], change[c]) * normal[c]
    v[i] = v[i] + inv_mass[i] * p
