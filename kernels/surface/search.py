"""Stage 7, search: the contact surface, where the pressures of the two sides balance.

A vertex of the region moves to x = x0 + a s, a in [0, 1]. Its traction is measured against s on its
own share of the surface, seen along s:

    tau = -F(x) . s^ / (A / 3),   A = sum of max(0, -n_t . s^) area_t over its triangles     [Pa]

(a nodal force carries a third of its triangles). The other side's traction is interpolated with
the weights of eqs. (1) and (2): P_other = sum w_i tau_i / sum w_i over the vertices that touch
this vertex's triangles. Where there are few, sum b_j tau_j over its own contact triangle is blended
in. A trial half way gives each side its stiffness, k = 2 (P(1/2) - P(0)). Then

    balanced   a = (k_other + c (P_other - P_own)) / (k_own + k_other)   with the pressures at x0
               a <- a + c (P_other - P_own) / (k_own + k_other)          with those at a

Both sides do so. With b the fraction of the other side they meet, a <- (a + 1 - b) / 2, so that
their disagreement leaves no gap or overlap. k is the stiffness of a side that moves as a whole. One
vertex alone is several times stiffer, so only the part c of an imbalance is corrected at a time.

    literal    P_own = f / A, P_other = sum w_i f_i / (A sum w_i) with f = -F . s^ (eq. 2 as
               printed: A is the same on both sides of the comparison and cancels), and
               a <- a +- 2^-(k + 2), k = 0, 1, ...: bisection from 1/2 on. P_other has the own
               triangle blended in as above, and pulling forces count as zero

A side whose vertices are all fixed is rigid: the other side moves by all of s.
"""

import warp as wp

from warp_contact.kernels.geometry import area_vector
from warp_contact.kernels.motion.motion import corner_sum
from warp_contact.kernels.narrow_phase.contact import Contact
from warp_contact.kernels.narrow_phase.contact_graph import ContactGraph
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

FEW = wp.constant(0.05)  # weight of touching vertices that counts as much as the own triangle
CAUTION = wp.constant(0.25)  # c above; with 1, neighbours alternate between 0 and 1
RIGID = wp.constant(-1.0)  # stands for the fraction of a rigid side


@wp.kernel
def begin_literal(
    # in
    s: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    area: wp.array[float],  # (n_vert,) 1: forces are compared
    fraction: wp.array[float],  # (n_vert,) 1/2
):
    """One thread per vertex: compare nodal forces; start half way."""
    i = wp.tid()
    area[i] = 1.0
    if wp.length_sq(s[i]) > 0.0:
        fraction[i] = 0.5


@wp.kernel
def begin_balance(
    # in
    tris: wp.array[wp.vec3i],  # (n_tri,)
    vs_start: wp.array[int],  # (n_vert + 1,)
    vs_tri: wp.array[int],  # (3 n_tri,)
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    s: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    area: wp.array[float],  # (n_vert,) [m^2]
    fraction: wp.array[float],  # (n_vert,) 1/2
):
    """One thread per vertex: its area of comparison; start half way."""
    i = wp.tid()
    if wp.length_sq(s[i]) == 0.0:
        return
    fraction[i] = 0.5
    along = wp.normalize(s[i])
    a = float(0.0)
    for e in range(vs_start[i], vs_start[i + 1]):
        t = tris[vs_tri[e]]
        n = area_vector(x[t[0]], x[t[1]], x[t[2]])
        a += wp.max(-wp.dot(n, along), 0.0) / 3.0
    area[i] = a


@wp.kernel
def tractions(
    # in
    vt_start: wp.array[int],  # (n_vert + 1,)
    vt_corner: wp.array[int],  # (4 n_tet,)
    f_tet: wp.array[wp.vec3],  # (4 n_tet,) [N]
    s: wp.array[wp.vec3],  # (n_vert,) [m]
    area: wp.array[float],  # (n_vert,) [m^2]
    # out
    traction: wp.array[float],  # (n_vert,) [Pa]
):
    """One thread per vertex of the region: the traction with which it resists s."""
    i = wp.tid()
    if wp.length_sq(s[i]) == 0.0:
        return
    f = corner_sum(i, vt_start, vt_corner, f_tet)
    traction[i] = 0.0
    if area[i] > 0.0:
        traction[i] = -wp.dot(f, wp.normalize(s[i])) / area[i]


@wp.kernel
def stiffnesses(
    # in
    s: wp.array[wp.vec3],  # (n_vert,) [m]
    before: wp.array[float],  # (n_vert,) [Pa] traction at x0
    half: wp.array[float],  # (n_vert,) [Pa] traction half way
    # out
    stiffness: wp.array[float],  # (n_vert,) [Pa] traction gained over the whole of s
):
    """One thread per vertex of the region: the stiffness of its side along s."""
    i = wp.tid()
    if wp.length_sq(s[i]) > 0.0:
        stiffness[i] = 2.0 * wp.max(half[i] - before[i], 0.0)


@wp.kernel
def side_means(
    # in
    threads: int,
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    s: wp.array[wp.vec3],  # (n_vert,) [m]
    traction: wp.array[float],  # (n_vert,) [Pa]
    stiffness: wp.array[float],  # (n_vert,) [Pa]
    fraction: wp.array[float],  # (n_vert,)
    # out
    upper: wp.array[wp.vec3],  # (capacity,) (traction, stiffness, fraction), side along n
    lower: wp.array[wp.vec3],  # (capacity,) the same of the other side
):
    """For each contact: interpolate both sides to the contact point."""
    for c in range(wp.tid(), n_contact[0], threads):
        up = wp.vec3(0.0, 0.0, 0.0)
        lo = wp.vec3(0.0, 0.0, 0.0)
        up_weight = float(0.0)
        lo_weight = float(0.0)
        at = contact[c]
        for k in range(5):
            i = at.vert[k]
            w = wp.abs(at.coef[k])
            if w > 0.0 and wp.length_sq(s[i]) > 0.0:
                value = wp.vec3(traction[i], stiffness[i], fraction[i])
                if k < 2:
                    up += w * value
                    up_weight += w
                else:
                    lo += w * value
                    lo_weight += w
        upper[c] = up / up_weight if up_weight > 0.0 else wp.vec3(0.0, 0.0, RIGID)
        lower[c] = lo / lo_weight if lo_weight > 0.0 else wp.vec3(0.0, 0.0, RIGID)


@wp.func
def opposite(
    i: int,
    graph: ContactGraph,
    contact: wp.array[Contact],
    residual: wp.array[float],
    upper: wp.array[wp.vec3],
    lower: wp.array[wp.vec3],
) -> wp.vec4:
    """Mean (traction, stiffness, fraction) of what vertex i touches, and the sum w_i.

    The fraction is RIGID when something it touches cannot move.
    """
    touch = wp.vec3(0.0, 0.0, 0.0)
    touch_weight = float(0.0)
    own = wp.vec3(0.0, 0.0, 0.0)
    own_weight = float(0.0)
    rigid = bool(False)
    for e in range(graph.start[i], graph.start[i + 1]):
        c = graph.entry[e] // 5
        k = graph.entry[e] - 5 * c
        w = wp.abs(contact[c].coef[k])
        if residual[c] > 0.0:
            if k < 2:
                own += w * lower[c]
                own_weight += w
                rigid = rigid or lower[c][2] == RIGID
            else:
                touch += w * upper[c]
                touch_weight += w
                rigid = rigid or upper[c][2] == RIGID
    mean = wp.vec3(0.0, 0.0, 0.0)
    if touch_weight > 0.0:
        mean = touch / touch_weight
    if own_weight > 0.0:
        share = touch_weight / (touch_weight + FEW)
        mean = share * mean + (1.0 - share) * own / own_weight
    if rigid:
        mean[2] = RIGID
    return wp.vec4(mean[0], mean[1], mean[2], touch_weight)


@wp.kernel
def correct_balance(
    # in
    anew: bool,  # start from the stiffnesses, not from the fraction so far
    graph: ContactGraph,
    contact: wp.array[Contact],  # (capacity,)
    residual: wp.array[float],  # (capacity,) [m]
    upper: wp.array[wp.vec3],  # (capacity,)
    lower: wp.array[wp.vec3],  # (capacity,)
    s: wp.array[wp.vec3],  # (n_vert,) [m]
    traction: wp.array[float],  # (n_vert,) [Pa]
    stiffness: wp.array[float],  # (n_vert,) [Pa]
    # in, out
    fraction: wp.array[float],  # (n_vert,)
):
    """One thread per vertex of the region: towards P_own(a) = P_other(1 - a)."""
    i = wp.tid()
    if wp.length_sq(s[i]) == 0.0:
        return
    other = opposite(i, graph, contact, residual, upper, lower)
    if other[2] == RIGID:
        fraction[i] = 1.0
        return
    k = stiffness[i] + other[1]
    if k > 0.0:
        a = fraction[i]
        if anew:
            a = other[1] / k
        fraction[i] = wp.clamp(a + CAUTION * (other[0] - traction[i]) / k, 0.0, 1.0)


@wp.kernel
def meet(
    # in
    graph: ContactGraph,
    contact: wp.array[Contact],  # (capacity,)
    residual: wp.array[float],  # (capacity,) [m]
    upper: wp.array[wp.vec3],  # (capacity,) of the solutions
    lower: wp.array[wp.vec3],  # (capacity,)
    s: wp.array[wp.vec3],  # (n_vert,) [m]
    # in, out
    fraction: wp.array[float],  # (n_vert,)
):
    """One thread per vertex of the region: half way to the fraction left by the other side."""
    i = wp.tid()
    if wp.length_sq(s[i]) == 0.0:
        return
    other = opposite(i, graph, contact, residual, upper, lower)
    if other[2] != RIGID:
        fraction[i] = 0.5 * (fraction[i] + 1.0 - other[2])


@wp.kernel
def bisect(
    # in
    step: float,  # 2^-(k + 2)
    graph: ContactGraph,
    contact: wp.array[Contact],  # (capacity,)
    residual: wp.array[float],  # (capacity,) [m]
    upper: wp.array[wp.vec3],  # (capacity,)
    lower: wp.array[wp.vec3],  # (capacity,)
    s: wp.array[wp.vec3],  # (n_vert,) [m]
    force: wp.array[float],  # (n_vert,) [N] with which the vertex resists s
    # in, out
    fraction: wp.array[float],  # (n_vert,)
):
    """One thread per vertex of the region: one step of the printed search, eq. (2)."""
    i = wp.tid()
    if wp.length_sq(s[i]) == 0.0:
        return
    other = opposite(i, graph, contact, residual, upper, lower)
    if other[2] == RIGID or wp.max(other[0], 0.0) > wp.max(force[i], 0.0):
        fraction[i] = fraction[i] + step
    else:
        fraction[i] = fraction[i] - step


@wp.kernel
def displace(
    # in
    bound: float,  # largest move, in edges
    vert_body: wp.array[int],  # (n_vert,)
    body_edge: wp.array[float],  # (n_body,) [m]
    x0: wp.array[wp.vec3],  # (n_vert,) [m]
    s: wp.array[wp.vec3],  # (n_vert,) [m]
    fraction: wp.array[float],  # (n_vert,)
    # out
    x: wp.array[wp.vec3],  # (n_vert,) [m]
):
    """One thread per vertex of the region: x = x0 + a s, with s shortened to the bound."""
    i = wp.tid()
    size = wp.length(s[i])
    if size > 0.0:
        x[i] = x0[i] + fraction[i] * wp.min(bound * body_edge[vert_body[i]] / size, 1.0) * s[i]
