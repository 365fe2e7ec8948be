"""Impulses of the last step, as a start for those of the next.

What rests on something needs almost the same impulses in every step. A vertex keeps those of its
first contact for one step, and its next contact with the same body starts from them; for contacts
of edges see persistent.py.
"""

import warp as wp

from warp_contact.kernels.impulse.tangent import turned
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)


@wp.func
def is_first(c: int, n_hit: int, vert: wp.array2d[int]) -> bool:
    """Whether contact c is the first of a vertex; hits are sorted by vertex."""
    return c < n_hit and (c == 0 or vert[c - 1, 0] != vert[c, 0])


@wp.kernel
def recall(
    # in
    threads: int,
    n_hit: wp.array[int],  # (1,)
    n_contact: wp.array[int],  # (1,)
    vert: wp.array2d[int],  # (capacity, 5)
    coef: wp.array2d[float],  # (capacity, 5)
    normal: wp.array[wp.vec3],  # (capacity,)
    pair: wp.array[wp.vec2i],  # (capacity,)
    weight: wp.array[float],  # (capacity,) [1/kg]
    open: wp.array[float],  # (capacity,) [m]
    turn: wp.array2d[wp.vec3],  # (capacity, 5) [1/m]
    mu: wp.array[float],  # (capacity,)
    ramp: wp.array[wp.vec3],  # (capacity,)
    partner: wp.array[int],  # (n_vert,) body of the first contact in the last step, or -1
    kept: wp.array[wp.vec4],  # (n_vert,) [N s] its tangential and normal impulse
    # in, out
    lam: wp.array[float],  # (capacity,) [N s]
    slip: wp.array[wp.vec3],  # (capacity,) [N s]
    # out
    ahead: wp.array[wp.vec4],  # (capacity,) [N s]
    part: wp.array[wp.vec3],  # (5 capacity,) [N s] what they are at each vertex
):
    """For each contact; those of edges have their impulses already."""
    for c in range(wp.tid(), n_contact[0], threads):
        n = normal[c]
        i = vert[c, 0]
        if weight[c] > 0.0 and is_first(c, n_hit[0], vert) and partner[i] == pair[c][1]:
            old = turned(kept[i], n, mu[c], ramp[c])
            lam[c] = old[3]
            slip[c] = wp.vec3(old[0], old[1], old[2])
            ahead[c] = old
        p = lam[c] * n + slip[c]
        for k in range(5):
            part[5 * c + k] = coef[c, k] * p + open[c] * wp.dot(turn[c, k], p) * n


@wp.kernel
def keep(
    # in
    threads: int,
    n_hit: wp.array[int],  # (1,)
    vert: wp.array2d[int],  # (capacity, 5)
    pair: wp.array[wp.vec2i],  # (capacity,)
    lam: wp.array[float],  # (capacity,) [N s]
    slip: wp.array[wp.vec3],  # (capacity,) [N s]
    # out
    partner: wp.array[int],  # (n_vert,)
    kept: wp.array[wp.vec4],  # (n_vert,) [N s]
):
    """For each contact of a vertex."""
    n = wp.min(n_hit[0], lam.shape[0])
    for c in range(wp.tid(), n, threads):
        if is_first(c, n, vert):
            partner[vert[c, 0]] = pair[c][1]
            kept[vert[c, 0]] = wp.vec4(slip[c][0], slip[c][1], slip[c][2], lam[c])
