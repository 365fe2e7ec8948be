"""How a vertex with a lumped mass answers an impulse; where row sums of other bodies lie.

    dv_i = G_i p,   G_i = 1 / m_i, 0 for a fixed vertex               mobility   [1/kg]

Where masses are lumped, an impulse on a vertex moves no other vertex within the step. Bodies that
take implicit steps answer as a whole (implicit/mobility.py); of their vertices it needs a bound.
"""

import warp as wp

from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)


@wp.struct
class Mobility:
    """The mobilities of all vertices."""

    inv_mass: wp.array[float]  # (n_vert,) [1/kg]
    row: wp.array[float]  # (n_vert,) [1/kg] row sums, 0 for lumped vertices; empty if all are


@wp.func
def mobility_of(i: int, bodies: Mobility) -> float:
    """G of vertex i [1/kg]."""
    return bodies.inv_mass[i]


@wp.func
def row_of(i: int, bodies: Mobility) -> float:
    """Row sum of vertex i over the contacts of its body [1/kg]; 0 for a lumped vertex."""
    if bodies.row.shape[0] == 0:
        return 0.0
    return bodies.row[i]
