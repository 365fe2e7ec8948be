"""Stage 5: normal impulses and Coulomb friction, all contacts at once, by mass splitting.

Contact c has vertices k with signed weights a_k (positive on the side that moves along n).

    u = sum a_k v_k                          relative velocity              [m/s]
    W = sum a_k^2 N_k / m_k                  N_k contacts share vertex k    [1/kg]
    lambda <- max(0, lambda - (u . n) / W)   target u . n >= 0              [N s]
    p_t <- p_t - u_t / W, |p_t| <= mu lambda                                [N s]
    v_k += a_k (d lambda n + d p_t) / m_k    with the whole mass

Each contact sees the share m_k / N_k of a vertex, so the sweep cannot add kinetic energy
(Tonge, Benevolenski and Voroshilov 2012). Equal and opposite per contact: momentum is kept exactly.
A fixed vertex has 1 / m = 0 and keeps its prescribed velocity.
"""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.func
def clamped(p: wp.vec3, bound: float) -> wp.vec3:
    """The vector p, shortened to the bound."""
    size = wp.length(p)
    if size > bound:
        return p * (bound / size)
    return p


@wp.kernel
def begin_contacts(
    # in
    first: wp.array[int],  # (1,) contacts before this one keep their impulses
    n_contact: wp.array[int],  # (1,)
    vert: wp.array2d[int],  # (capacity, 5)
    coef: wp.array2d[float],  # (capacity, 5)
    start: wp.array[int],  # (n_vert + 1,)
    inv_mass: wp.array[float],  # (n_vert,) [1/kg]
    # out
    weight: wp.array[float],  # (capacity,) [1/kg]
    lam: wp.array[float],  # (capacity,) [N s]
    slip: wp.array[wp.vec3],  # (capacity,) [N s]
):
    """One thread per contact: W, and no impulse yet on the new ones."""
    c = wp.tid()
    if c >= n_contact[0]:
        return
    w = float(0.0)
    for k in range(5):
        a = coef[c, k]
        i = vert[c, k]
        w += a * a * inv_mass[i] * float(start[i + 1] - start[i])
    weight[c] = w
    if c >= first[0]:
        lam[c] = 0.0
        slip[c] = wp.vec3(0.0, 0.0, 0.0)


@wp.kernel
def solve_contacts(
    # in
    mu: float,
    n_contact: wp.array[int],  # (1,)
    vert: wp.array2d[int],  # (capacity, 5)
    coef: wp.array2d[float],  # (capacity, 5)
    normal: wp.array[wp.vec3],  # (capacity,)
    weight: wp.array[float],  # (capacity,) [1/kg]
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    # in, out
    lam: wp.array[float],  # (capacity,) [N s] accumulated normal impulse
    slip: wp.array[wp.vec3],  # (capacity,) [N s] accumulated friction impulse
    # out
    change: wp.array[wp.vec3],  # (capacity,) [N s] what this sweep adds
):
    """One thread per contact: update its accumulated impulses."""
    c = wp.tid()
    if c >= n_contact[0]:
        return
    if weight[c] == 0.0:
        change[c] = wp.vec3(0.0, 0.0, 0.0)
        return
    u = wp.vec3(0.0, 0.0, 0.0)
    for k in range(5):
        u += coef[c, k] * v[vert[c, k]]
    n = normal[c]
    un = wp.dot(u, n)
    new_lam = wp.max(lam[c] - un / weight[c], 0.0)
    new_slip = wp.vec3(0.0, 0.0, 0.0)
    if mu > 0.0:
        new_slip = clamped(slip[c] - (u - un * n) / weight[c], mu * new_lam)
    change[c] = (new_lam - lam[c]) * n + new_slip - slip[c]
    lam[c] = new_lam
    slip[c] = new_slip


@wp.kernel
def apply_impulses(
    # in
    start: wp.array[int],  # (n_vert + 1,)
    entry: wp.array[int],  # (5 capacity,)
    coef: wp.array2d[float],  # (capacity, 5)
    change: wp.array[wp.vec3],  # (capacity,) [N s]
    inv_mass: wp.array[float],  # (n_vert,) [1/kg]
    # in, out
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    impulse: wp.array[wp.vec3],  # (n_vert,) [N s] received since the frame began
):
    """One thread per vertex: gather the impulses of its contacts in their order."""
    i = wp.tid()
    if start[i] == start[i + 1]:
        return
    p = wp.vec3(0.0, 0.0, 0.0)
    for e in range(start[i], start[i + 1]):
        c = entry[e] // 5
        p += coef[c, entry[e] - 5 * c] * change[c]
    v[i] = v[i] + inv_mass[i] * p
    impulse[i] = impulse[i] + p


@wp.kernel
def add_pair_impulses(
    # in
    unit: float,  # momentum of one count [N s]
    n_contact: wp.array[int],  # (1,)
    pair: wp.array[wp.vec2i],  # (capacity,)
    normal: wp.array[wp.vec3],  # (capacity,)
    lam: wp.array[float],  # (capacity,) [N s]
    slip: wp.array[wp.vec3],  # (capacity,) [N s]
    # in, out
    key: wp.array[wp.int64],  # (n_pair,) lower body * 2^32 + upper body, -1 where free
    total: wp.array2d[wp.int64],  # (n_pair, 3) on the lower body, since the frame began
    needed: wp.array[int],  # (1,) pairs that would have been enough
):
    """One thread per contact: add to its pair, as integers, whose sum has no order."""
    c = wp.tid()
    if c >= n_contact[0] or lam[c] <= 0.0:
        return
    p = lam[c] * normal[c] + slip[c]
    lo = pair[c][0]
    hi = pair[c][1]
    if lo > hi:
        lo = pair[c][1]
        hi = pair[c][0]
        p = -p
    name = (wp.int64(lo) << wp.int64(32)) | wp.int64(hi)
    n = key.shape[0]
    slot = int((wp.uint32(lo) * wp.uint32(73856093) ^ wp.uint32(hi) * wp.uint32(19349663)) % wp.uint32(n))
    for _probe in range(n):
        seen = wp.atomic_cas(key, slot, wp.int64(-1), name)
        if seen == wp.int64(-1) or seen == name:
            for k in range(3):
                wp.atomic_add(total, slot, k, wp.int64(wp.round(wp.float64(p[k]) / wp.float64(unit))))
            return
        slot = (slot + 1) % n
    wp.atomic_max(needed, 0, n + 1)
