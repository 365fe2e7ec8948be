"""Lanczos steps with A = M^-1 K, for all bodies at once.

    a_j       = q_j . M A q_j                              [1/s^2]
    b_j q_j+1 = A q_j - a_j q_j - b_{j-1} q_{j-1}          q_i . M q_j = 1 for i = j, else 0

A is self-adjoint in the mass inner product and does not couple bodies, so every body has its own
a, b. Sums run over chunks of vertices, then over the chunks of a body, in fixed order and in
double precision: runs repeat bit for bit. The coefficients of a body are a column of ``coef``,
whose rows are b_{-1}^2, a_0, b_0^2, a_1, b_1^2, ... with b_{-1}^2 the square of the start vector.

Source: Parlett 1998, "The symmetric eigenvalue problem".
"""

import warp as wp

from warp_contact.kernels.motion import motion
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

BREAKDOWN = wp.constant(wp.float64(1.0e-10))  # b^2 / a^2 at which float32 vectors are rounding


@wp.func
def in_double(y: wp.vec3) -> wp.vec3d:
    return wp.vec3d(wp.float64(y[0]), wp.float64(y[1]), wp.float64(y[2]))


@wp.func
def mass_product(m: float, x: wp.vec3, y: wp.vec3) -> wp.float64:
    """M x . y, in double precision where it is too large for a float32: small, stiff bodies."""
    p = m * wp.dot(x, y)
    if wp.isfinite(p):
        return wp.float64(p)
    return wp.float64(m) * wp.dot(in_double(x), in_double(y))


@wp.kernel
def restart(
    # in
    inv_mass: wp.array[float],  # (n_vert,) [1/kg], 0 for a fixed vertex
    noise: wp.array[wp.vec3],  # (n_vert,)
    vert_body: wp.array[int],  # (n_vert,)
    ritz: wp.array2d[float],  # (n_body, m), coefficients of the Ritz vector
    amount: float,  # [-]
    # in, out
    basis: wp.array2d[wp.vec3],  # (m + 1, n_vert)
):
    """One thread per vertex: set row 0 to the Ritz vector, plus noise; fixed vertices to 0."""
    i = wp.tid()
    s = amount * noise[i]
    for j in range(ritz.shape[1]):
        s += ritz[vert_body[i], j] * basis[j, i]
    basis[0, i] = wp.where(inv_mass[i] > 0.0, s, wp.vec3(0.0, 0.0, 0.0))


@wp.kernel
def multiply(
    # in
    chunk: wp.array[int],  # (n_chunk + 1,) first vertex of each chunk
    vt_start: wp.array[int],  # (n_vert + 1,)
    vt_corner: wp.array[int],  # (4 n_tet,)
    f_tet: wp.array[wp.vec3],  # (4 n_tet,), K q_j
    mass: wp.array[float],  # (n_vert,) [kg]
    inv_mass: wp.array[float],  # (n_vert,) [1/kg], 0 for a fixed vertex
    j: int,
    # in, out
    basis: wp.array2d[wp.vec3],  # (m + 1, n_vert), sets row j + 1 to A q_j
    # out
    part: wp.array[wp.float64],  # (n_chunk,), q_j . M A q_j
):
    """One thread per chunk of vertices: apply A, and sum for a_j."""
    k = wp.tid()
    s = wp.float64(0.0)
    for i in range(chunk[k], chunk[k + 1]):
        y = inv_mass[i] * motion.corner_sum(i, vt_start, vt_corner, f_tet)
        s += mass_product(mass[i], basis[j, i], y)
        basis[j + 1, i] = y
    part[k] = s


@wp.kernel
def orthogonalise(
    # in
    chunk: wp.array[int],  # (n_chunk + 1,) first vertex of each chunk
    vert_body: wp.array[int],  # (n_vert,)
    mass: wp.array[float],  # (n_vert,) [kg]
    coef: wp.array2d[wp.float64],  # (2 m + 1, n_body)
    j: int,
    # in, out
    basis: wp.array2d[wp.vec3],  # (m + 1, n_vert), sets row j + 1 to b_j q_{j+1}
    # out
    part: wp.array[wp.float64],  # (n_chunk,), b_j^2
):
    """One thread per chunk of vertices; j = -1 only measures the start vector."""
    k = wp.tid()
    b = vert_body[chunk[k]]
    s = wp.float64(0.0)
    for i in range(chunk[k], chunk[k + 1]):
        y = basis[j + 1, i]
        if j >= 0:
            y -= float(coef[2 * j + 1, b]) * basis[j, i]
        if j > 0:
            y -= float(wp.sqrt(coef[2 * j, b])) * basis[j - 1, i]
        s += mass_product(mass[i], y, y)
        basis[j + 1, i] = y
    part[k] = s


@wp.kernel
def add_up(
    # in
    body_chunk: wp.array[int],  # (n_body + 1,) first chunk of each body
    part: wp.array[wp.float64],  # (n_chunk,)
    row: int,
    # out
    coef: wp.array2d[wp.float64],  # (2 m + 1, n_body), sets one row
):
    """One thread per body: sum its chunks."""
    b = wp.tid()
    s = wp.float64(0.0)
    for k in range(body_chunk[b], body_chunk[b + 1]):
        s += part[k]
    coef[row, b] = s


@wp.kernel
def normalise(
    # in
    vert_body: wp.array[int],  # (n_vert,)
    coef: wp.array2d[wp.float64],  # (2 m + 1, n_body)
    j: int,
    # in, out
    basis: wp.array2d[wp.vec3],  # (m + 1, n_vert), divides row j by b_{j-1}
):
    """One thread per vertex: zero where the Krylov space of the body is exhausted."""
    i = wp.tid()
    b = vert_body[i]
    b2 = coef[2 * j, b]
    least = wp.float64(0.0)
    if j > 0:
        a = coef[2 * j - 1, b]
        least = BREAKDOWN * a * a
    if b2 > least:
        basis[j, i] = float(wp.float64(1.0) / wp.sqrt(b2)) * basis[j, i]
    else:
        basis[j, i] = wp.vec3(0.0, 0.0, 0.0)
