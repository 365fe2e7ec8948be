"""Forces that close the gaps predicted without contact, in one pass.

After Spillmann, Becker and Teschner 2007. Their formulas were not at hand; this is a reconstruction
of the idea with the contacts of this package:

    x* = x + h v*                                 end of the step without contact [m]
    g = (sum a_k x*_k) . n - offset               its gap                         [m]
    lambda = h F,  F = max(0, -g) / (h^2 W)       normal impulse of a step        [N s]

with W of impulse.py, where N_k contacts share vertex k. A single contact is closed exactly: F moves
its two sides by h^2 W F against each other. Where N contacts ask the same of a vertex, each gives
it the N-th part. Friction (one_pass.py) acts against the slip of v*.
"""

import warp as wp

from warp_contact.kernels.impulse.one_pass import give, relative_velocity
from warp_contact.kernels.narrow_phase.gap import gap
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)


@wp.kernel
def predicted_impulses(
    # in
    threads: int,
    n_body: int,
    mu: float,
    dt: wp.array[float],  # (1,) [s]
    n_contact: wp.array[int],  # (1,)
    vert: wp.array2d[int],  # (capacity, 5)
    coef: wp.array2d[float],  # (capacity, 5)
    normal: wp.array[wp.vec3],  # (capacity,)
    offset: wp.array[float],  # (capacity,) [m]
    pair: wp.array[wp.vec2i],  # (capacity,)
    weight: wp.array[float],  # (capacity,) [1/kg]
    coupled: wp.array[float],  # (capacity,) [1/kg]
    open: wp.array[float],  # (capacity,) [m]
    turn: wp.array2d[wp.vec3],  # (capacity, 5) [1/m]
    x: wp.array[wp.vec3],  # (n_vert,) [m] predicted
    v: wp.array[wp.vec3],  # (n_vert,) [m/s] predicted
    # out
    lam: wp.array[float],  # (capacity,) [N s]
    slip: wp.array[wp.vec3],  # (capacity,) [N s]
    part: wp.array[wp.vec3],  # (5 capacity,) [N s] its part at each vertex
):
    """For each contact: the impulse of the predicted force over one step."""
    for c in range(wp.tid(), n_contact[0], threads):
        p = float(0.0)
        if weight[c] > 0.0:
            g = gap(c, vert, coef, normal, offset, pair[c][1] >= n_body, x)
            p = wp.max(-g, 0.0) / (dt[0] * weight[c])
        u = relative_velocity(c, vert, coef, v)
        give(c, p, u, mu, coef, normal, coupled, open, turn, lam, slip, part)
