"""How a vertex answers an impulse: the only place where the contact solver looks this up.

    dv_i = G_i p,   G_i = 1 / m_i, 0 for a fixed vertex               mobility   [1/kg]

Masses are lumped: an impulse on a vertex moves no other vertex within the step.
"""

import warp as wp

from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)


@wp.struct
class Mobility:
    """The mobilities of all vertices."""

    inv_mass: wp.array[float]  # (n_vert,) [1/kg]


@wp.func
def mobility_of(i: int, bodies: Mobility) -> float:
    """G of vertex i [1/kg]."""
    return bodies.inv_mass[i]
