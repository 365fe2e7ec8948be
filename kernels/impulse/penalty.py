"""The response that the paper compares with: a force proportional to the penetration depth.

Heidelberger et al. 2004, with Coulomb friction as in Keiser et al. 2004 (one_pass.py):

    lambda = h max(0, k d - c u . n)              normal impulse of a step [N s]
"""

import warp as wp

from warp_contact.kernels.impulse.constraint import Constraint, Impulse, coefficient
from warp_contact.kernels.impulse.one_pass import give, with_friction
from warp_contact.kernels.narrow_phase.contact import Contact, relative_velocity
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)


@wp.func
def impulse_of_spring(
    length: float,  # that it is pressed by [m]; without force if not above 0
    spring: wp.vec2,  # stiffness [N/m], damping [N s/m]
    mu: float,
    h: float,  # [s]
    u: wp.vec3,  # [m/s]
    n: wp.vec3,
    to: Constraint,
) -> Impulse:
    """The impulse of a spring along n over one step, with friction."""
    p = float(0.0)
    if to.inv_mass_turning > 0.0 and length > 0.0:
        p = h * wp.max(spring[0] * length - spring[1] * wp.dot(u, n), 0.0)
    return with_friction(p, n, u, mu, to)


@wp.kernel
def penalty_impulses(
    # in
    threads: int,
    spring: wp.vec2,  # stiffness [N/m], damping [N s/m]
    friction: wp.array[float],  # (n_body + n_plane,) Coulomb coefficients
    dt: wp.array[float],  # (n_vert,) [s]
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    constraint: wp.array[Constraint],  # (capacity,)
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    # out
    impulse: wp.array[Impulse],  # (capacity,)
    part: wp.array[wp.vec3],  # (5 capacity,) [N s] its part at each vertex
):
    """For each contact: the impulse of the penalty force over one step."""
    for c in range(wp.tid(), n_contact[0], threads):
        at = contact[c]
        u = relative_velocity(at, v)
        h = dt[at.vert[0]]
        mu = coefficient(at.pair, friction)
        given = impulse_of_spring(at.depth, spring, mu, h, u, at.normal, constraint[c])
        impulse[c] = given
        give(c, given, at, constraint[c], part)
