"""The kernels of a hyperelastic model, made from its three functions.

A model gives, at the deformation gradient F = I + g, for moduli mu and lam (any scale: stresses are
linear in them),

    stress(g, mu, lam)                     P, first Piola-Kirchhoff                 [Pa]
    stress_differential(g, df, mu, lam)    its change with F by df                  [Pa]
    energy_density(g, mu, lam)             psi, of which P is the derivative        [Pa]

The damping is the viscous stress of tet.py, with a damping time beta [s]. A row of ``param`` is
(mu, lam, beta).
"""

import warp as wp

from warp_contact.kernels.elastic import tet as element

ROW = wp.vec3  # of param


def kernels_of(
    stress: wp.Function, stress_differential: wp.Function, energy_density: wp.Function, model: str
) -> tuple[wp.Kernel, wp.Kernel, wp.Kernel, wp.Kernel]:
    """Forces, stiffness, damping and energies of a model, as kernels of the module ``model``."""
    module = wp.get_module(model)

    @wp.kernel(module=module)
    def set_forces(
        # in
        tet: wp.array[int],  # (n,) tet ids
        param: wp.array[wp.vec3],  # (n,) mu [Pa], lam [Pa], beta [s]
        mask: wp.array[int],  # (n_tet,) tets with 0 are skipped
        tets: wp.array[wp.vec4i],  # (n_tet,)
        pose: wp.array[wp.mat33],  # (n_tet,) [1/m]
        volume: wp.array[float],  # (n_tet,) [m^3]
        x: wp.array[wp.vec3],  # (n_vert,) [m]
        # out
        f_tet: wp.array[wp.vec3],  # (4 n_tet,) [N]
    ):
        """One thread per tet of the model: set its corner forces, minus the energy gradient."""
        r = wp.tid()
        q = tet[r]
        if mask[q] == 0:
            return
        g = element.displacement_gradient(q, tets, pose, x)
        m = -volume[q] * param[r]  # stresses are linear in the moduli
        element.store_stress(q, stress(g, m[0], m[1]), pose, f_tet)

    @wp.kernel(module=module)
    def apply_stiffness(
        # in
        tet: wp.array[int],  # (n,) tet ids
        param: wp.array[wp.vec3],  # (n,) mu [Pa], lam [Pa], beta [s]
        tets: wp.array[wp.vec4i],  # (n_tet,)
        pose: wp.array[wp.mat33],  # (n_tet,) [1/m]
        volume: wp.array[float],  # (n_tet,) [m^3]
        x: wp.array[wp.vec3],  # (n_vert,) [m]
        dx: wp.array[wp.vec3],  # (n_vert,) [m]
        # out
        f_tet: wp.array[wp.vec3],  # (4 n_tet,) [N]
    ):
        """One thread per tet of the model: set its corner entries of K(x) dx."""
        r = wp.tid()
        q = tet[r]
        df = element.rate(q, tets, pose, dx)
        if wp.ddot(df, df) == 0.0:  # a body of which nothing is asked
            element.store_stress(q, df, pose, f_tet)
            return
        g = element.displacement_gradient(q, tets, pose, x)
        m = volume[q] * param[r]
        element.store_stress(q, stress_differential(g, df, m[0], m[1]), pose, f_tet)

    @wp.kernel(module=module)
    def apply_damping(
        # in
        tet: wp.array[int],  # (n,) tet ids
        param: wp.array[wp.vec3],  # (n,) mu [Pa], lam [Pa], beta [s]
        tets: wp.array[wp.vec4i],  # (n_tet,)
        pose: wp.array[wp.mat33],  # (n_tet,) [1/m]
        volume: wp.array[float],  # (n_tet,) [m^3]
        x: wp.array[wp.vec3],  # (n_vert,) [m]
        v: wp.array[wp.vec3],  # (n_vert,) [m/s]
        # out
        f_tet: wp.array[wp.vec3],  # (4 n_tet,) [N]
    ):
        """One thread per tet of the model: set its corner entries of C(x) v."""
        r = wp.tid()
        q = tet[r]
        df = element.rate(q, tets, pose, v)
        if wp.ddot(df, df) == 0.0:
            element.store_stress(q, df, pose, f_tet)
            return
        f = element.rate(q, tets, pose, x)
        m = volume[q] * param[r][2] * param[r]
        element.store_stress(q, element.viscous_stress(f, df, m[0], m[1]), pose, f_tet)

    @wp.kernel(module=module)
    def energies(
        # in
        tet: wp.array[int],  # (n,) tet ids
        param: wp.array[wp.vec3],  # (n,) mu [Pa], lam [Pa], beta [s]
        tets: wp.array[wp.vec4i],  # (n_tet,)
        pose: wp.array[wp.mat33],  # (n_tet,) [1/m]
        volume: wp.array[float],  # (n_tet,) [m^3]
        x: wp.array[wp.vec3],  # (n_vert,) [m]
        # out
        energy: wp.array[float],  # (n_tet,) [J]
    ):
        """One thread per tet of the model: set its elastic energy."""
        r = wp.tid()
        q = tet[r]
        g = element.displacement_gradient(q, tets, pose, x)
        energy[q] = volume[q] * energy_density(g, param[r][0], param[r][1])

    return set_forces, apply_stiffness, apply_damping, energies
