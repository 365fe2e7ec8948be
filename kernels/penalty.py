"""The response the paper compares with: a force proportional to the penetration depth.

Heidelberger et al. 2004, with Coulomb friction as in Keiser et al. 2004:

    lambda = h max(0, k d - c u . n)              normal impulse of a step [N s]
    p_t = -min(mu lambda, |u_t| / W) u_t^         friction
"""

import warp as wp

from warp_contact.kernels.impulse import clamped

wp.set_module_options({"enable_backward": False})


@wp.kernel
def penalty_impulses(
    # in
    stiffness: float,  # [N/m]
    damping: float,  # [N s/m]
    mu: float,
    dt: wp.array[float],  # (1,) [s]
    n_contact: wp.array[int],  # (1,)
    vert: wp.array2d[int],  # (capacity, 5)
    coef: wp.array2d[float],  # (capacity, 5)
    normal: wp.array[wp.vec3],  # (capacity,)
    depth: wp.array[float],  # (capacity,) [m]
    weight: wp.array[float],  # (capacity,) [1/kg]
    open: wp.array[float],  # (capacity,) [m]
    turn: wp.array2d[wp.vec3],  # (capacity, 5) [1/m]
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    # out
    lam: wp.array[float],  # (capacity,) [N s]
    slip: wp.array[wp.vec3],  # (capacity,) [N s]
    part: wp.array[wp.vec3],  # (5 capacity,) [N s] its part at each vertex
):
    """One thread per contact: the impulse of the penalty force over one step."""
    c = wp.tid()
    if c >= n_contact[0]:
        return
    u = wp.vec3(0.0, 0.0, 0.0)
    active = float(0.0)
    for k in range(5):
        u += coef[c, k] * v[vert[c, k]]
        active += wp.abs(coef[c, k])
    n = normal[c]
    un = wp.dot(u, n)
    lam[c] = 0.0
    slip[c] = wp.vec3(0.0, 0.0, 0.0)
    if active > 0.0 and weight[c] > 0.0 and depth[c] > 0.0:
        lam[c] = dt[0] * wp.max(stiffness * depth[c] - damping * un, 0.0)
        slip[c] = clamped(-(u - un * n) / weight[c], mu * lam[c])
    p = lam[c] * n + slip[c]
    for k in range(5):
        part[5 * c + k] = coef[c, k] * p + open[c] * wp.dot(turn[c, k], p) * n
