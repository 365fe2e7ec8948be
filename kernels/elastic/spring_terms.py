"""The three kinds of springs on one tet: forces, products with the stiffness, energy.

Formulas, units and the columns of ``param`` stand in ``springs.py``. Rows of a mat43 belong to the
corners of the tet: positions p [m], displacements or velocities u, forces f [N].
"""

import warp as wp

from warp_contact.kernels.elastic import tet as element
from warp_contact.kernels.options import ARITHMETIC

wp.set_module_options(ARITHMETIC)

mat43 = wp.types.matrix(shape=(4, 3), dtype=float)
TINY = wp.constant(1.0e-2)  # of the rest size: below it the stiffness against turning grows no more


@wp.func
def corners(q: int, tets: wp.array[wp.vec4i], u: wp.array[wp.vec3]) -> mat43:
    t = tets[q]
    return wp.matrix_from_rows(u[t[0]], u[t[1]], u[t[2]], u[t[3]])


@wp.func
def edge_forces(p: mat43, r: int, param: wp.array2d[float]) -> mat43:
    f = mat43(0.0)
    e = int(0)
    for a in range(3):
        for b in range(a + 1, 4):
            d = p[b] - p[a]
            length = param[r, 6 + e]
            g = param[r, e] * (wp.length(d) - length) / (length * length) * wp.normalize(d)
            f[a] += g
            f[b] -= g
            e += 1
    return f


@wp.func
def edge_products(p: mat43, u: mat43, r: int, param: wp.array2d[float], tension: float) -> mat43:
    f = mat43(0.0)
    e = int(0)
    for a in range(3):
        for b in range(a + 1, 4):
            d = p[b] - p[a]
            du = u[b] - u[a]
            n = wp.normalize(d)
            along = wp.dot(n, du) * n
            length = param[r, 6 + e]
            slack = tension * (1.0 - length / wp.max(wp.length(d), TINY * length))
            g = param[r, e] / (length * length) * (along + slack * (du - along))
            f[a] -= g
            f[b] += g
            e += 1
    return f


@wp.func
def face(p: mat43, i: int) -> wp.mat33:
    """Rows: the corners of the face opposite to corner i."""
    return wp.matrix_from_rows(p[(i + 1) % 4], p[(i + 2) % 4], p[(i + 3) % 4])


@wp.func
def spread(g: wp.mat33, i: int) -> mat43:
    f = mat43(0.0)
    f[(i + 1) % 4] = g[0]
    f[(i + 2) % 4] = g[1]
    f[(i + 3) % 4] = g[2]
    return f


@wp.func
def area_gradient(n: wp.vec3, t: wp.mat33) -> wp.mat33:
    """Rows dA/dx of a triangle with corners t and unit normal n; linear in n and in t."""
    dt = wp.matrix_from_rows(t[2] - t[1], t[0] - t[2], t[1] - t[0])
    return 0.5 * wp.matrix_from_rows(wp.cross(n, dt[0]), wp.cross(n, dt[1]), wp.cross(n, dt[2]))


@wp.func
def face_product(t: wp.mat33, u: wp.mat33, k: float, area: float, tension: float) -> wp.mat33:
    normal = wp.cross(t[1] - t[0], t[2] - t[0])
    size = wp.length(normal)
    n = wp.normalize(normal)
    grad = area_gradient(n, t)
    dnormal = wp.cross(u[1] - u[0], t[2] - t[0]) + wp.cross(t[1] - t[0], u[2] - u[0])
    dn = (dnormal - wp.dot(n, dnormal) * n) / wp.max(size, TINY * area)
    dgrad = area_gradient(dn, t) + area_gradient(n, u)
    excess = tension * (0.5 * size - area)
    return k / (area * area) * (wp.ddot(grad, u) * grad + excess * dgrad)


@wp.func
def face_forces(p: mat43, r: int, param: wp.array2d[float]) -> mat43:
    f = mat43(0.0)
    for i in range(4):
        if param[r, 12 + i] > 0.0:
            t = face(p, i)
            normal = wp.cross(t[1] - t[0], t[2] - t[0])
            area = param[r, 16 + i]
            strain = (0.5 * wp.length(normal) - area) / area
            g = -param[r, 12 + i] * strain / area * area_gradient(wp.normalize(normal), t)
            f += spread(g, i)
    return f


@wp.func
def face_products(p: mat43, u: mat43, r: int, param: wp.array2d[float], tension: float) -> mat43:
    f = mat43(0.0)
    for i in range(4):
        k = param[r, 12 + i]
        if k > 0.0:
            f += spread(face_product(face(p, i), face(u, i), k, param[r, 16 + i], tension), i)
    return f


@wp.func
def edge_matrix(p: mat43) -> wp.mat33:
    return wp.matrix_from_cols(p[1] - p[0], p[2] - p[0], p[3] - p[0])


@wp.func
def rows_of(h: wp.mat33) -> mat43:
    """Corner values whose sum is zero from the columns for corners 1, 2, 3."""
    t = wp.transpose(h)
    return wp.matrix_from_rows(-(t[0] + t[1] + t[2]), t[0], t[1], t[2])


@wp.func
def volume_forces(p: mat43, k: float, volume: float) -> mat43:
    d = edge_matrix(p)
    strain = (wp.determinant(d) / 6.0 - volume) / volume
    return rows_of(-k * strain / (6.0 * volume) * element.cof(d))


@wp.func
def volume_products(p: mat43, u: mat43, k: float, volume: float, tension: float) -> mat43:
    d = edge_matrix(p)
    du = edge_matrix(u)
    c = element.cof(d)
    excess = tension * (wp.determinant(d) - 6.0 * volume)
    h = wp.ddot(c, du) * c + excess * element.cof_differential(d, du)
    return rows_of(k / (36.0 * volume * volume) * h)


@wp.func
def products(p: mat43, u: mat43, r: int, param: wp.array2d[float], volume: float, tension: float):
    """K u for tension = 1, without its part C ddC u for tension = 0."""
    f = edge_products(p, u, r, param, tension) + face_products(p, u, r, param, tension)
    return f + volume_products(p, u, param[r, 20], volume, tension)


@wp.func
def energy_sum(p: mat43, r: int, param: wp.array2d[float], volume: float) -> float:
    c = (wp.determinant(edge_matrix(p)) / 6.0 - volume) / volume
    twice = param[r, 20] * c * c
    e = int(0)
    for a in range(3):
        for b in range(a + 1, 4):
            c = wp.length(p[b] - p[a]) / param[r, 6 + e] - 1.0
            twice += param[r, e] * c * c
            e += 1
    for i in range(4):
        t = face(p, i)
        normal = wp.cross(t[1] - t[0], t[2] - t[0])
        c = 0.5 * wp.length(normal) / param[r, 16 + i] - 1.0
        twice += param[r, 12 + i] * c * c
    return 0.5 * twice


@wp.func
def store(q: int, f: mat43, f_tet: wp.array[wp.vec3]):
    for a in range(4):
        f_tet[4 * q + a] = f[a]
