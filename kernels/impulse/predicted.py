"""Forces that close the gaps predicted without contact, in one pass.

After Spillmann, Becker and Teschner 2007. Their formulas were not at hand; this is a reconstruction
of the idea with the contacts of this package:

    x* = x + h v*                                 end of the step without contact [m]
    g = (sum a_k x*_k) . n - offset               its gap                         [m]
    lambda = h F,  F = max(0, -g) / (h^2 W)       normal impulse of a step        [N s]

with W of constraint.py, where N_k contacts share vertex k. A single contact closes exactly: F moves
its two sides by h^2 W F relative to each other. Where N contacts need the same of a vertex, each
gives it the N-th part. Where some bodies take implicit steps W is a bound (rows.py), and one that
is alone closes in part too, over several steps. Friction (one_pass.py) acts against the sliding
velocity of v*.
"""

import warp as wp

from warp_contact.kernels.impulse.constraint import Constraint, Impulse, coefficient
from warp_contact.kernels.impulse.one_pass import give, with_friction
from warp_contact.kernels.narrow_phase.contact import Contact, gap, relative_velocity
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)


@wp.kernel
def predicted_impulses(
    # in
    threads: int,
    friction: wp.array[float],  # (n_body + n_plane,) Coulomb coefficients
    dt: wp.array[float],  # (n_vert,) [s]
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    constraint: wp.array[Constraint],  # (capacity,)
    x: wp.array[wp.vec3],  # (n_vert,) [m] predicted
    v: wp.array[wp.vec3],  # (n_vert,) [m/s] predicted
    # out
    impulse: wp.array[Impulse],  # (capacity,)
    part: wp.array[wp.vec3],  # (5 capacity,) [N s] its part at each vertex
):
    """For each contact: the impulse of the predicted force over one step."""
    for c in range(wp.tid(), n_contact[0], threads):
        at = contact[c]
        to = constraint[c]
        p = float(0.0)
        if to.inv_mass > 0.0:
            g = gap(at, x)
            p = wp.max(-g, 0.0) / (dt[at.vert[0]] * to.inv_mass)
        mu = coefficient(at.pair, friction)
        given = with_friction(p, at.normal, relative_velocity(at, v), mu, to)
        impulse[c] = given
        give(c, given, at, to, part)
