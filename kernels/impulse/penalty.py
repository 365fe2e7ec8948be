"""The response that the paper compares with: a force proportional to the penetration depth.

Heidelberger et al. 2004, with Coulomb friction as in Keiser et al. 2004 (one_pass.py):

    lambda = h max(0, k d - c u . n)              normal impulse of a step [N s]
"""

import warp as wp

from warp_contact.kernels.impulse.constraint import Constraint, Impulse
from warp_contact.kernels.impulse.impulse import part_of
from warp_contact.kernels.impulse.one_pass import with_friction
from warp_contact.kernels.narrow_phase.contact import Contact, relative_velocity
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)


@wp.kernel
def penalty_impulses(
    # in
    threads: int,
    stiffness: float,  # [N/m]
    damping: float,  # [N s/m]
    mu: float,
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
        to = constraint[c]
        u = relative_velocity(at, v)
        p = float(0.0)
        if to.inv_mass_turning > 0.0 and at.depth > 0.0:
            p = dt[at.vert[0]] * wp.max(stiffness * at.depth - damping * wp.dot(u, at.normal), 0.0)
        given = with_friction(p, at.normal, u, mu, to)
        for k in range(5):
            part[5 * c + k] = part_of(k, at, to, given.normal * at.normal + given.friction)
        impulse[c] = given
