"""Fixed corotated elasticity on linear tets.

    psi = mu |F - R|^2 + lam/2 (J - 1)^2                   energy density            [Pa]
    P   = 2 mu (F - R) + lam (J - 1) cof F                 first Piola stress        [Pa]
    dP  = 2 mu (dF - dR) + lam (cof F : dF) cof F + lam (J - 1) dcof F
    dR  = R [w]x,  (tr S I - S) w = axl(R^T dF),  S = sym(R^T F)

F = R S is the polar decomposition, with det R = +1 even for an inverted tet, whose S then has
one negative eigenvalue. mu, lam are the Lame parameters [Pa], beta the damping time [s] of the
viscous stress in ``tet.viscous_stress``. For a Poisson ratio of 0 a bar stretched by s carries
P = E (s - 1). R comes from the closed form of Markley, which maximises tr(R^T F) over the
rotations:

    R = ((k + |F|^2) F + y cof F - F F^T F) / z,  k = (y^2 - |F|^2)/2,  z = k y - J
    y   largest root of y^4 - 2 |F|^2 y^2 - 8 J y + |F|^4 - 4 |cof F|^2

z = (s1 + s2)(s2 + s3)(s3 + s1) with the signed singular values s. Where z vanishes (a tet collapsed
to a line, or mirrored), R jumps. There a singular value decomposition picks one of the maximisers.

Sources: Stomakhin et al. 2012, "Energetically consistent invertible elasticity";
Markley 1993, "Attitude determination using vector observations: a fast optimal matrix algorithm".
"""

import warp as wp

from warp_contact.kernels.elastic import tet as element
from warp_contact.kernels.elastic.hyperelastic import ROW, kernels_of
from warp_contact.kernels.options import ARITHMETIC

wp.set_module_options(ARITHMETIC)

__all__ = ["ROW", "apply_damping", "apply_stiffness", "energies", "set_forces"]

NEWTON = wp.constant(8)  # steps at most, from sqrt(3) |F|: above the root, and exact at rest
ROUNDING = wp.constant(1.0e-6)  # of the quartic in y, relative to |F|^4
DEGENERATE = wp.constant(1.0e-2)  # z / |F|^3 below which float32 loses the closed form


@wp.func
def rotation(f: wp.mat33) -> wp.mat33:
    """R of the polar decomposition f = R S, det R = 1."""
    c = element.cof(f)
    n2 = wp.ddot(f, f)
    j = wp.dot(element.column(f, 0), element.column(c, 0))
    n4 = n2 * n2 - 4.0 * wp.ddot(c, c)
    y = wp.sqrt(3.0 * n2)
    for _ in range(NEWTON):
        p = ((y * y - 2.0 * n2) * y - 8.0 * j) * y + n4
        slope = (4.0 * y * y - 4.0 * n2) * y - 8.0 * j
        if p <= ROUNDING * n2 * n2 or slope <= 0.0:  # from above, down to the rounding error of p
            break
        y -= p / slope
    k = 0.5 * (y * y - n2)
    z = k * y - j
    if z > DEGENERATE * n2 * wp.sqrt(n2):
        r = ((k + n2) * f + y * c - f * (wp.transpose(f) * f)) / z
        return 1.5 * r - 0.5 * (r * (wp.transpose(r) * r))  # orthonormal to the last bit
    u, _s, v = wp.svd3(f)
    return u * wp.transpose(v)


@wp.func
def rotation_differential(f: wp.mat33, r: wp.mat33, df: wp.mat33) -> wp.mat33:
    a = wp.transpose(r) * f
    b = wp.transpose(r) * df
    one = wp.identity(n=3, dtype=float)
    m = wp.trace(a) * one - 0.5 * (a + wp.transpose(a))
    c = element.cof(m)
    z = wp.dot(element.column(m, 0), element.column(c, 0))
    n2 = wp.ddot(f, f)
    # R has no differential where z = 0. The floor keeps dR finite next to the jump.
    z = wp.max(z, DEGENERATE * n2 * wp.sqrt(n2) + 1.0e-30)
    w = c * wp.vec3(b[2, 1] - b[1, 2], b[0, 2] - b[2, 0], b[1, 0] - b[0, 1]) / z
    return r * wp.skew(w)


@wp.func
def stress(g: wp.mat33, mu: float, lam: float) -> wp.mat33:
    """P at F = I + g."""
    cof_g = element.cof(g)
    f = g + wp.identity(n=3, dtype=float)
    j = element.dilation(g, cof_g)
    return 2.0 * mu * (f - rotation(f)) + lam * j * element.cof_near_identity(g, cof_g)


@wp.func
def stress_differential(g: wp.mat33, df: wp.mat33, mu: float, lam: float) -> wp.mat33:
    cof_g = element.cof(g)
    f = g + wp.identity(n=3, dtype=float)
    dr = rotation_differential(f, rotation(f), df)
    j = element.dilation(g, cof_g)
    c = element.cof_near_identity(g, cof_g)
    dc = element.cof_differential(f, df)
    return 2.0 * mu * (df - dr) + lam * wp.ddot(c, df) * c + lam * j * dc


@wp.func
def energy_density(g: wp.mat33, mu: float, lam: float) -> float:
    f = g + wp.identity(n=3, dtype=float)
    strain = f - rotation(f)
    j = element.dilation(g, element.cof(g))
    return mu * wp.ddot(strain, strain) + 0.5 * lam * j * j


set_forces, apply_stiffness, apply_damping, energies = kernels_of(
    stress, stress_differential, energy_density, __name__
)
