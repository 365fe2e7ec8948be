"""Stable neo-Hookean elasticity without the logarithmic term, on linear tets.

    psi = mu/2 (I_C - 3) - mu (J - 1) + l/2 (J - 1)^2 + l b        energy density    [Pa]
    P   = mu F + (l (J - 1 + b') - mu) cof F                       first Piola stress [Pa]
    dP  = mu dF + l (1 + b'') (cof F : dF) cof F + (l (J - 1 + b') - mu) dcof F
    l   = lam + mu                                 so that small strains have the moduli (mu, lam)
    b   = -10 (J - J0)^2 ln(J / J0)  for J < J0 = 1/4, its tangent parabola below 1/20, else 0

I_C = F : F, J = det F; mu, lam are the Lame parameters of small strain [Pa], beta the damping
time [s] of the viscous stress in ``tet.viscous_stress``. P is a polynomial in F, except for the
logarithm between 1/20 and 1/4. It is finite and pushes back for flat and inverted tets.

The barrier b is not in the source. Without it a column with free sides carries at most 0.23, 0.81
or 2.2 E along its axis, for a Poisson ratio of 0, 0.3 or 0.4. A larger load turns it inside out,
however short the step. b adds nothing to the pressure above J0, 14 l at J = 1/20 and 32 l at J = 0.
l is 1.8 E for a ratio of 0.4.

Energies are written in the Green strain E = (F^T F - I)/2, because I_C - 3 cancels in float32:

    psi = mu (tr E (J - 1) - 4 tr cof E - 8 det E)/(J + 1) + l/2 (J - 1)^2,  J > 0

Source: Smith, de Goes, Kim 2018, "Stable neo-Hookean flesh simulation".
"""

import warp as wp

from warp_contact.kernels.elastic import tet as element
from warp_contact.kernels.elastic.hyperelastic import ROW, kernels_of
from warp_contact.kernels.options import ARITHMETIC

wp.set_module_options(ARITHMETIC)

__all__ = ["ROW", "apply_damping", "apply_stiffness", "energies", "set_forces"]


SQUASHED = wp.constant(0.25)  # J0
CRUSHED = wp.constant(0.05)  # J below which b is a parabola
BARRIER = wp.constant(10.0)


@wp.func
def barrier(j: float) -> wp.vec3:
    """b, b' and b'' at J = 1 + j."""
    k = 1.0 + j
    if k >= SQUASHED:
        return wp.vec3(0.0, 0.0, 0.0)
    c = wp.max(k, CRUSHED)
    d = c - SQUASHED
    log = wp.log(c / SQUASHED)
    value = -BARRIER * d * d * log
    slope = -BARRIER * (2.0 * d * log + d * d / c)
    bend = -BARRIER * (2.0 * log + 4.0 * d / c - d * d / (c * c))
    e = k - c
    return wp.vec3(value + e * slope + 0.5 * e * e * bend, slope + e * bend, bend)


@wp.func
def stress(g: wp.mat33, mu: float, lam: float) -> wp.mat33:
    """P at F = I + g, without finite terms that cancel as g goes to 0."""
    cof_g = element.cof(g)
    j = element.dilation(g, cof_g)
    difference = (
        g + wp.transpose(g) - wp.trace(g) * wp.identity(n=3, dtype=float) - cof_g
    )  # F - cof F
    p = (lam + mu) * (j + barrier(j)[1])
    return mu * difference + p * element.cof_near_identity(g, cof_g)


@wp.func
def stress_differential(g: wp.mat33, df: wp.mat33, mu: float, lam: float) -> wp.mat33:
    cof_g = element.cof(g)
    j = element.dilation(g, cof_g)
    cof_f = element.cof_near_identity(g, cof_g)
    f = g + wp.identity(n=3, dtype=float)
    l = lam + mu
    b = barrier(j)
    along = l * (1.0 + b[2]) * wp.ddot(cof_f, df) * cof_f
    return mu * df + along + (l * (j + b[1]) - mu) * element.cof_differential(f, df)


@wp.func
def energy_density(g: wp.mat33, mu: float, lam: float) -> float:
    j = element.dilation(g, element.cof(g))
    e = 0.5 * (g + wp.transpose(g) + wp.transpose(g) * g)
    i = wp.trace(e)
    shear = i - j
    if j > -0.5:  # near J = -1 the quotient is 0/0, and there is no cancellation
        shear = (i * j - 4.0 * wp.trace(element.cof(e)) - 8.0 * wp.determinant(e)) / (j + 2.0)
    return mu * shear + (lam + mu) * (0.5 * j * j + barrier(j)[0])


set_forces, apply_stiffness, apply_damping, energies = kernels_of(
    stress, stress_differential, energy_density, __name__
)
