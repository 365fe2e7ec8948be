"""Friction of the responses with one pass: it follows from the normal impulse of each contact.

    p_t = -min(mu lambda, |u_t| / W_t) u_t^       friction, W_t of tangent.py [N s]

The vertices receive the torque of friction across a gap as in tangent.py. u is the plain relative
velocity, without the turning of the surface.
"""

import warp as wp

from warp_contact.kernels.impulse.constraint import Constraint, Impulse
from warp_contact.kernels.impulse.impulse import part_of
from warp_contact.kernels.impulse.tangent import clamped
from warp_contact.kernels.narrow_phase.contact import Contact
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)


@wp.func
def with_friction(
    normal: float,  # impulse [N s], 0 where nothing can move
    n: wp.vec3,
    u: wp.vec3,  # [m/s]
    mu: float,
    to: Constraint,
) -> Impulse:
    """The impulse of a contact."""
    out = Impulse()
    out.normal = normal
    if normal > 0.0:
        out.friction = clamped(-(u - wp.dot(u, n) * n) / to.inv_mass_turning, mu * normal)
    return out


@wp.func
def give(c: int, given: Impulse, at: Contact, to: Constraint, part: wp.array[wp.vec3]):
    """Set the parts of contact c at its vertices."""
    for k in range(5):
        part[5 * c + k] = part_of(k, at, to, given.normal * at.normal + given.friction)
