"""Stage 1, predict: corner forces gathered, symplectic Euler.

    f_i = sum of f_tet over the corners at vertex i        [N]
    v'  = v + h (f / m + g)                                [m/s]
    x'  = x + h v'                                         [m]

``vt_corner`` lists the corners at a vertex as 4 tet + corner. They are added in the order of
that list and never by atomics, so runs repeat bit for bit.
"""

import warp as wp

from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)


@wp.func
def corner_sum(
    i: int, vt_start: wp.array[int], vt_corner: wp.array[int], f_tet: wp.array[wp.vec3]
) -> wp.vec3:
    f = wp.vec3(0.0, 0.0, 0.0)
    for k in range(vt_start[i], vt_start[i + 1]):
        f += f_tet[vt_corner[k]]
    return f


@wp.kernel
def gather(
    # in
    vt_start: wp.array[int],  # (n_vert + 1,)
    vt_corner: wp.array[int],  # (4 n_tet,)
    f_tet: wp.array[wp.vec3],  # (4 n_tet,) [N]
    # out
    f: wp.array[wp.vec3],  # (n_vert,) [N]
):
    """One thread per vertex: sum the forces on its tet corners."""
    i = wp.tid()
    f[i] = corner_sum(i, vt_start, vt_corner, f_tet)


@wp.kernel
def kick(
    # in
    vt_start: wp.array[int],  # (n_vert + 1,)
    vt_corner: wp.array[int],  # (4 n_tet,)
    f_tet: wp.array[wp.vec3],  # (4 n_tet,) [N]
    inv_mass: wp.array[float],  # (n_vert,) [1/kg], 0 for a fixed vertex
    gravity: wp.array[wp.vec3],  # (1,) [m/s^2]
    dt: wp.array[float],  # (n_vert,) [s]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    # out
    x_new: wp.array[wp.vec3],  # (n_vert,) [m], may be x
    v_new: wp.array[wp.vec3],  # (n_vert,) [m/s], may be v
):
    """One thread per vertex: kick by the forces and drift; fixed vertices keep their velocity."""
    i = wp.tid()
    h = dt[i]
    u = v[i]
    if inv_mass[i] > 0.0:
        u += h * (inv_mass[i] * corner_sum(i, vt_start, vt_corner, f_tet) + gravity[0])
    v_new[i] = u
    x_new[i] = x[i] + h * u


@wp.kernel
def advance(
    # in
    dt: wp.array[float],  # (n_vert,) [s]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    # out
    x_new: wp.array[wp.vec3],  # (n_vert,) [m], may be x
):
    """One thread per vertex: drift."""
    i = wp.tid()
    x_new[i] = x[i] + dt[i] * v[i]


@wp.kernel
def count_down(
    # in
    needed: wp.array[int],  # what did not fit in its buffer, 0 where all did
    # in, out
    steps: wp.array[int],  # (1,) steps that the frame still has: none when it has to be repeated
):
    """One thread, at the end of a step: count it down."""
    steps[0] = steps[0] - 1
    for k in range(needed.shape[0]):
        if needed[k] > 0:
            steps[0] = 0
