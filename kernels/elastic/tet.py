"""What every tet kernel shares: the deformation gradient and the forces of a stress.

    F = Ds Dm^-1                    deformation gradient    [-]
    Ds = [x1-x0, x2-x0, x3-x0]      edges, now              [m]
    Dm^-1 = pose                    rest edges, inverted    [1/m]
    [f1, f2, f3] = -V P Dm^-T       forces of a first Piola-Kirchhoff stress P [Pa]
    f0 = -(f1 + f2 + f3)            V rest volume [m^3], f [N]
    cof F = dJ/dF = J F^-T          J = det F

Near rest F = I + G with a small G, which float32 resolves far better than 1 + G:

    J - 1   = tr G + tr cof G + det G
    cof F   = (1 + tr G) I - G^T + cof G

Source: Sifakis and Barbic 2012 (SIGGRAPH course "FEM simulation of 3D deformable solids").
"""

import warp as wp

from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)


@wp.func
def edges(t: wp.vec4i, u: wp.array[wp.vec3]) -> wp.mat33:
    """Differences of a nodal field from the first corner, as columns: Ds for u = x."""
    u0 = u[t[0]]
    return wp.matrix_from_cols(u[t[1]] - u0, u[t[2]] - u0, u[t[3]] - u0)


@wp.func
def rate(q: int, tets: wp.array[wp.vec4i], pose: wp.array[wp.mat33], u: wp.array[wp.vec3]):
    """Gradient of a nodal field over tet q: F for u = x, its differential for u = dx."""
    return edges(tets[q], u) * pose[q]


@wp.func
def displacement_gradient(
    q: int, tets: wp.array[wp.vec4i], pose: wp.array[wp.mat33], x: wp.array[wp.vec3]
):
    """G = F - I."""
    return rate(q, tets, pose, x) - wp.identity(n=3, dtype=float)


@wp.func
def column(a: wp.mat33, j: int) -> wp.vec3:
    return wp.vec3(a[0, j], a[1, j], a[2, j])


@wp.func
def cof(a: wp.mat33) -> wp.mat33:
    a0 = column(a, 0)
    a1 = column(a, 1)
    a2 = column(a, 2)
    return wp.matrix_from_cols(wp.cross(a1, a2), wp.cross(a2, a0), wp.cross(a0, a1))


@wp.func
def cof_differential(a: wp.mat33, b: wp.mat33) -> wp.mat33:
    """Differential of cof at a along b; equals 2 cof(a) for b = a."""
    a0 = column(a, 0)
    a1 = column(a, 1)
    a2 = column(a, 2)
    b0 = column(b, 0)
    b1 = column(b, 1)
    b2 = column(b, 2)
    return wp.matrix_from_cols(
        wp.cross(a1, b2) + wp.cross(b1, a2),
        wp.cross(a2, b0) + wp.cross(b2, a0),
        wp.cross(a0, b1) + wp.cross(b0, a1),
    )


@wp.func
def cof_near_identity(g: wp.mat33, cof_g: wp.mat33) -> wp.mat33:
    """Return cof(I + g)."""
    return (1.0 + wp.trace(g)) * wp.identity(n=3, dtype=float) - wp.transpose(g) + cof_g


@wp.func
def dilation(g: wp.mat33, cof_g: wp.mat33) -> float:
    """det(I + g) - 1."""
    return wp.trace(g) + wp.trace(cof_g) + wp.determinant(g)


@wp.func
def viscous_stress(f: wp.mat33, df: wp.mat33, mu: float, lam: float) -> wp.mat33:
    """First Piola stress F S of S = 2 mu Edot + lam tr(Edot) I, Edot = sym(F^T Fdot).

    Moduli are multiplied by the damping time [Pa s].

    Edot vanishes for every rigid motion of the deformed tet, and S : Edot >= 0 as long as
    mu > 0 and 2 mu + 3 lam > 0, that is for every Poisson ratio above -1.
    """
    a = wp.transpose(f) * df
    s = mu * (a + wp.transpose(a)) + lam * wp.trace(a) * wp.identity(n=3, dtype=float)
    return f * s


@wp.func
def store_stress(q: int, vp: wp.mat33, pose: wp.array[wp.mat33], f_tet: wp.array[wp.vec3]):
    """Set tet q in f_tet to vp Dm^-T, vp = -V P [J] for forces and +V P for their opposite."""
    h = vp * wp.transpose(pose[q])
    h1 = column(h, 0)
    h2 = column(h, 1)
    h3 = column(h, 2)
    f_tet[4 * q] = -(h1 + h2 + h3)
    f_tet[4 * q + 1] = h1
    f_tet[4 * q + 2] = h2
    f_tet[4 * q + 3] = h3
