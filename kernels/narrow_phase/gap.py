"""What a contact record says about positions: its gap, and how it turns with the surfaces.

    g = (sum a_k x_k) . n - offset        gap of five weighted vertices along a direction   [m]
    b_k                                   how the direction turns with the vertices         [1/m]

When the vertices of a surface move by u_k, its normal turns by -sum b_k (n . u_k): b_k = grad w_k
over a triangle, and over two edges the same in the basis of their directions.
"""

import warp as wp

from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

REST = wp.constant(2.0e-4)  # of an edge: the gap that is left between bodies at rest


@wp.func
def gap(
    c: int,
    vert: wp.array2d[int],
    coef: wp.array2d[float],
    normal: wp.array[wp.vec3],
    offset: wp.array[float],
    on_plane: bool,
    x: wp.array[wp.vec3],
) -> float:
    """Gap of a contact [m]; positions relative to one vertex keep float32 exact far out."""
    origin = x[vert[c, 0]]
    if on_plane:
        return wp.dot(origin, normal[c]) - offset[c]
    r = wp.vec3(0.0, 0.0, 0.0)
    for k in range(5):
        r += coef[c, k] * (x[vert[c, k]] - origin)
    return wp.dot(r, normal[c])


@wp.func
def gradient(
    k: int,
    c: int,
    vert: wp.array2d[int],
    n: wp.vec3,
    x: wp.array[wp.vec3],
) -> wp.vec3:
    """b_k of a contact between bodies [1/m]."""
    p = x[vert[c, 0]]
    q = x[vert[c, 1]]
    a = x[vert[c, 2]]
    b = x[vert[c, 3]]
    if vert[c, 3] == vert[c, 4]:  # two edges
        if k == 4:
            return wp.vec3(0.0, 0.0, 0.0)
        along = wp.cross(b - a, n)
        other = q - p
        if k >= 2:
            along = wp.cross(q - p, n)
            other = b - a
        whole = wp.dot(along, other)
        if whole == 0.0:
            return wp.vec3(0.0, 0.0, 0.0)
        if k == 0 or k == 2:
            return -along / whole
        return along / whole
    if k < 2:
        return wp.vec3(0.0, 0.0, 0.0)
    d = x[vert[c, 4]]
    whole = wp.dot(n, wp.cross(b - a, d - a))
    if whole == 0.0:
        return wp.vec3(0.0, 0.0, 0.0)
    across = a - b
    if k == 2:
        across = b - d
    if k == 3:
        across = d - a
    return wp.cross(across, n) / whole
