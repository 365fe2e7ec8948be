"""How much tets have changed their shape, and whether one is flat; rigid motion changes nothing.

    G = D E,  change = largest |entry| of G^T G - 1        D edges of the tet now, E inverse before

E is kept from the positions to compare with. A tet that was flat then has changed without limit.
"""

import warp as wp

from warp_contact.kernels import tet as element
from warp_contact.kernels.geometry import NONE
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)


@wp.kernel
def remember(
    # in
    tets: wp.array[wp.vec4i],  # (n_tet,)
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    before: wp.array[wp.mat33],  # (n_tet,) [1/m] E
):
    """One thread per tet."""
    q = wp.tid()
    before[q] = wp.inverse(element.edges(tets[q], x))


@wp.kernel
def changes(
    # in
    tets: wp.array[wp.vec4i],  # (n_tet,)
    vert_body: wp.array[int],  # (n_vert,)
    before: wp.array[wp.mat33],  # (n_tet,) [1/m]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # out, added to
    change: wp.array[float],  # (n_body,) largest of its tets
):
    """One thread per tet."""
    q = wp.tid()
    g = element.rate(q, tets, before, x)
    s = wp.transpose(g) @ g - wp.identity(n=3, dtype=float)
    most = float(0.0)
    for i in range(3):
        for j in range(3):
            most = wp.max(most, wp.abs(s[i, j]))
    if not wp.ddot(s, s) < NONE or wp.determinant(before[q]) == 0.0:
        most = NONE
    wp.atomic_max(change, vert_body[tets[q][0]], most)


@wp.kernel
def squashed(
    # in
    tets: wp.array[wp.vec4i],  # (n_tet,)
    pose: wp.array[wp.mat33],  # (n_tet,) [1/m]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    least: float,  # volume, of that at rest
    # in, out
    found: wp.array[int],  # (1,) set to 1 where a tet has less
):
    """One thread per tet."""
    q = wp.tid()
    if wp.determinant(element.rate(q, tets, pose, x)) < least:
        found[0] = 1
