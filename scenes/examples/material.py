"""A material of one's own, St. Venant-Kirchhoff, with a barrier b that makes flat tets push back.

    P = F S + (lam + mu) b' cof F,  S = 2 mu E + lam tr(E) I,  E = (F^T F - I) / 2    [Pa]

The recipe is in kernels/README.md. ``warp-contact run scenes/examples/material.py --out out/ball``
"""

from types import ModuleType

import warp as wp

import warp_contact as wc
from warp_contact.kernels.elastic import hyperelastic, neo_hookean, tet


@wp.func
def green(g: wp.mat33) -> wp.mat33:
    return 0.5 * (g + wp.transpose(g) + wp.transpose(g) * g)


@wp.func
def stress(g: wp.mat33, mu: float, lam: float) -> wp.mat33:
    f = g + wp.identity(n=3, dtype=float)
    s = 2.0 * mu * green(g) + lam * wp.trace(green(g)) * wp.identity(n=3, dtype=float)
    return f * s + (lam + mu) * neo_hookean.barrier(wp.determinant(f) - 1.0)[1] * tet.cof(f)


@wp.func
def stress_differential(g: wp.mat33, df: wp.mat33, mu: float, lam: float) -> wp.mat33:
    f = g + wp.identity(n=3, dtype=float)
    s = 2.0 * mu * green(g) + lam * wp.trace(green(g)) * wp.identity(n=3, dtype=float)
    b = (lam + mu) * neo_hookean.barrier(wp.determinant(f) - 1.0)
    bulk = b[2] * wp.ddot(tet.cof(f), df) * tet.cof(f) + b[1] * tet.cof_differential(f, df)
    return df * s + tet.viscous_stress(f, df, mu, lam) + bulk  # F dS has the form of a viscous one


@wp.func
def energy_density(g: wp.mat33, mu: float, lam: float) -> float:
    e, j = green(g), tet.dilation(g, tet.cof(g))
    elastic = mu * wp.ddot(e, e) + 0.5 * lam * wp.trace(e) * wp.trace(e)
    return elastic + (lam + mu) * neo_hookean.barrier(j)[0]


class StVenantKirchhoff(wc.NeoHookean):  # the same numbers and checks
    kernels = ModuleType(__name__)


made = hyperelastic.kernels_of(stress, stress_differential, energy_density, __name__)
names = ("set_forces", "apply_stiffness", "apply_damping", "energies")
vars(StVenantKirchhoff.kernels).update(zip(names, made, strict=True), ROW=wp.vec3)


def build() -> wc.Scene:
    """A ball of it that falls on a floor."""
    scene = wc.Scene()
    scene.add_plane((0.0, 0.0, 1.0))
    scene.add_body(wc.sphere(0.05, 147), StVenantKirchhoff(1e5, 0.3, 1000.0, 1e-3), (0, 0, 0.06))
    return scene
