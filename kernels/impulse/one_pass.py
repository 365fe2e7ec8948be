"""What forces of one pass share: each contact is given a normal impulse, friction follows from it.

    p_t = -min(mu lambda, |u_t| / W_c) u_t^       friction, W_c of tangent.py [N s]

The vertices receive the couple of friction across a gap as in tangent.py; u is the plain relative
velocity, without the turning.
"""

import warp as wp

from warp_contact.kernels.impulse.tangent import clamped
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)


@wp.func
def relative_velocity(
    c: int,
    vert: wp.array2d[int],
    coef: wp.array2d[float],
    v: wp.array[wp.vec3],
) -> wp.vec3:
    """Of the two sides of a contact [m/s]."""
    u = wp.vec3(0.0, 0.0, 0.0)
    for k in range(5):
        u += coef[c, k] * v[vert[c, k]]
    return u


@wp.func
def give(
    c: int,
    impulse: float,  # [N s] along the normal, 0 where the contact has no weight
    u: wp.vec3,  # [m/s]
    mu: float,
    coef: wp.array2d[float],
    normal: wp.array[wp.vec3],
    coupled: wp.array[float],
    open: wp.array[float],
    turn: wp.array2d[wp.vec3],
    lam: wp.array[float],
    slip: wp.array[wp.vec3],
    part: wp.array[wp.vec3],
):
    """Set the impulses of a contact and their parts at its vertices."""
    n = normal[c]
    rubbed = wp.vec3(0.0, 0.0, 0.0)
    if impulse > 0.0:
        rubbed = clamped(-(u - wp.dot(u, n) * n) / coupled[c], mu * impulse)
    p = impulse * n + rubbed
    for k in range(5):
        part[5 * c + k] = coef[c, k] * p + open[c] * wp.dot(turn[c, k], p) * n
    lam[c] = impulse
    slip[c] = rubbed
