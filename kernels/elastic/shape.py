"""How much tets have changed their shape, and whether one is flat; rigid motion changes nothing.

    G = D E,  change = largest |entry| of G^T G - 1        D edges of the tet now, E inverse before

E is stored at the positions to compare with. A tet that was flat there has changed without limit.
"""

import warp as wp

from warp_contact.kernels.elastic import tet as element
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
    """One thread per tet: store its shape."""
    q = wp.tid()
    before[q] = wp.inverse(element.edges(tets[q], x))


@wp.kernel
def changes(
    # in
    tets: wp.array[wp.vec4i],  # (n_tet,)
    vert_body: wp.array[int],  # (n_vert,)
    pose: wp.array[wp.mat33],  # (n_tet,) [1/m]
    before: wp.array[wp.mat33],  # (n_tet,) [1/m]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    least: float,  # part of its rest volume below which a tet is flat
    # out, added to
    change: wp.array2d[float],  # (2, n_body) largest of its tets; 1 if one of them is flat
):
    """One thread per tet: its change of shape, and whether it is flat."""
    q = wp.tid()
    g = element.rate(q, tets, before, x)
    s = wp.transpose(g) @ g - wp.identity(n=3, dtype=float)
    most = float(0.0)
    for i in range(3):
        for j in range(3):
            most = wp.max(most, wp.abs(s[i, j]))
    if not wp.ddot(s, s) < NONE or wp.determinant(before[q]) == 0.0:
        most = NONE
    body = vert_body[tets[q][0]]
    wp.atomic_max(change, 0, body, most)
    if wp.determinant(element.rate(q, tets, pose, x)) < least:
        change[1, body] = 1.0
