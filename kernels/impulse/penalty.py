"""The response the paper compares with: a force proportional to the penetration depth.

Heidelberger et al. 2004, with Coulomb friction as in Keiser et al. 2004 (one_pass.py):

    lambda = h max(0, k d - c u . n)              normal impulse of a step [N s]
"""

import warp as wp

from warp_contact.kernels.impulse.one_pass import give, relative_velocity
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)


@wp.kernel
def penalty_impulses(
    # in
    threads: int,
    stiffness: float,  # [N/m]
    damping: float,  # [N s/m]
    mu: float,
    dt: wp.array[float],  # (1,) [s]
    n_contact: wp.array[int],  # (1,)
    vert: wp.array2d[int],  # (capacity, 5)
    coef: wp.array2d[float],  # (capacity, 5)
    normal: wp.array[wp.vec3],  # (capacity,)
    depth: wp.array[float],  # (capacity,) [m]
    coupled: wp.array[float],  # (capacity,) [1/kg]
    open: wp.array[float],  # (capacity,) [m]
    turn: wp.array2d[wp.vec3],  # (capacity, 5) [1/m]
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    # out
    lam: wp.array[float],  # (capacity,) [N s]
    slip: wp.array[wp.vec3],  # (capacity,) [N s]
    part: wp.array[wp.vec3],  # (5 capacity,) [N s] its part at each vertex
):
    """For each contact: the impulse of the penalty force over one step."""
    for c in range(wp.tid(), n_contact[0], threads):
        u = relative_velocity(c, vert, coef, v)
        p = float(0.0)
        if coupled[c] > 0.0 and depth[c] > 0.0:
            p = dt[0] * wp.max(stiffness * depth[c] - damping * wp.dot(u, normal[c]), 0.0)
        give(c, p, u, mu, coef, normal, coupled, open, turn, lam, slip, part)
