"""Springs that preserve distances, areas and the volume of tets.

    E = k C^2 / 2,   f_i = -k C dC/dx_i                   k energy of a spring [J], C strain [-]
    C = (|d| - D) / D                                     distance, over an edge d [m]
    C = (A - A0) / A0,   A = |a x b| / 2                  area, over a surface triangle
    C = (V - V0) / V0,   V = a . (b x c) / 6              volume, signed, over a tet
    K dx = k (dC (dC . dx) + C ddC dx)                    stiffness, dC = dC/dx
    C_damp v = beta k dC (dC . v)                         damping: as K at rest, but never negative

Rigid motion does not change C and is therefore not damped. A spring shared by
several tets is split among them, so that each tet is computed by itself. Columns of ``param``:

     0 -  5  energies of the edges 01, 02, 03, 12, 13, 23     [J], share of this tet
     6 - 11  their rest lengths D                             [m]
    12 - 15  energies of the faces opposite to 0, 1, 2, 3     [J], 0 inside the body
    16 - 19  their rest areas A0                              [m^2]
    20       energy of the volume                             [J]
    21       damping time beta                                [s]

Source: Teschner, Heidelberger, Mueller, Gross 2004, "A versatile and robust model for
geometrically complex deformable solids".
"""

import warp as wp

from warp_contact.kernels.elastic import spring_terms as terms
from warp_contact.kernels.options import ARITHMETIC

wp.set_module_options(ARITHMETIC)

ROW = float  # param has two dimensions


@wp.kernel
def set_forces(
    # in
    tet: wp.array[int],  # (n,) tet ids
    param: wp.array2d[float],  # (n, 22)
    mask: wp.array[int],  # (n_tet,) tets with 0 are skipped
    tets: wp.array[wp.vec4i],  # (n_tet,)
    pose: wp.array[wp.mat33],  # (n_tet,) [1/m], not used
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
    p = terms.corners(q, tets, x)
    f = terms.edge_forces(p, r, param) + terms.face_forces(p, r, param)
    terms.store(q, f + terms.volume_forces(p, param[r, 20], volume[q]), f_tet)


@wp.kernel
def apply_stiffness(
    # in
    tet: wp.array[int],  # (n,) tet ids
    param: wp.array2d[float],  # (n, 22)
    tets: wp.array[wp.vec4i],  # (n_tet,)
    pose: wp.array[wp.mat33],  # (n_tet,) [1/m], not used
    volume: wp.array[float],  # (n_tet,) [m^3]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    dx: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    f_tet: wp.array[wp.vec3],  # (4 n_tet,) [N]
):
    """One thread per tet of the model: set its corner entries of K(x) dx."""
    r = wp.tid()
    q = tet[r]
    f = terms.products(
        terms.corners(q, tets, x), terms.corners(q, tets, dx), r, param, volume[q], 1.0
    )
    terms.store(q, f, f_tet)


@wp.kernel
def apply_damping(
    # in
    tet: wp.array[int],  # (n,) tet ids
    param: wp.array2d[float],  # (n, 22)
    tets: wp.array[wp.vec4i],  # (n_tet,)
    pose: wp.array[wp.mat33],  # (n_tet,) [1/m], not used
    volume: wp.array[float],  # (n_tet,) [m^3]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    # out
    f_tet: wp.array[wp.vec3],  # (4 n_tet,) [N]
):
    """One thread per tet of the model: set its corner entries of C(x) v."""
    r = wp.tid()
    q = tet[r]
    f = terms.products(
        terms.corners(q, tets, x), terms.corners(q, tets, v), r, param, volume[q], 0.0
    )
    terms.store(q, param[r, 21] * f, f_tet)


@wp.kernel
def energies(
    # in
    tet: wp.array[int],  # (n,) tet ids
    param: wp.array2d[float],  # (n, 22)
    tets: wp.array[wp.vec4i],  # (n_tet,)
    pose: wp.array[wp.mat33],  # (n_tet,) [1/m], not used
    volume: wp.array[float],  # (n_tet,) [m^3]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    energy: wp.array[float],  # (n_tet,) [J]
):
    """One thread per tet of the model: set its elastic energy."""
    r = wp.tid()
    q = tet[r]
    energy[q] = terms.energy_sum(terms.corners(q, tets, x), r, param, volume[q])
