"""Stage 1 of bodies with damping: forces and damping of a step at once.

    M dv/dt = f + m g + m c / h - C v            over a step h, f and C at its start     [N]
    v' = v + phi(h L) (b - h L v),  b = h (f / m + g) + c,  L = M^-1 C                  [m/s]
    v'' = v' - c                                                                        [m/s]

It is exact for phi(z) = (1 - exp(-z)) / z. A polynomial takes its place, a sum of Chebyshev
polynomials T_k of A = 1 - 2 h L / Z, where Z bounds the eigenvalues of h L (frame/damping.py):

    r_0 = b - h L v,  r_1 = A r_0,  r_k = 2 A r_{k-1} - r_{k-2},  v' = v + sum coef_k r_k

The coefficients add up to 1: weight acts undamped, and momentum is kept to rounding.

c is the change of velocity that contacts will cause in this step, extrapolated from the last two:
c = 2 c_1 - c_2, 0 where nothing touched. They are added by the impulses, so they are taken off
again. Without c, the load on a vertex at rest in a contact would leak into its neighbours before
the impulses act, and the state at rest would depend on the damping. If forces acted after the
damping alone, v' = exp(-h L) v + h f / m, overdamped modes would relax h L times too fast.

For a mode of frequency w with damping z, symplectic Euler is then v' = p v - h w^2 phi x,
x' = x + h v', p = 1 - z phi: stable for (h w)^2 < 2 (1 + p) / phi, which is 4 or more.

Sources: Hochbruck and Ostermann 2010, "Exponential integrators", section 2; Abramowitz and Stegun
1964, 22.7.4, for the recurrence.
"""

import warp as wp

from warp_contact.kernels.motion.motion import corner_sum
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)


@wp.func
def expected(last: wp.vec3, before: wp.vec3) -> wp.vec3:
    """What contacts will change in this step, from what they did in the last two [m/s]."""
    if wp.length_sq(last) == 0.0:
        return last
    return 2.0 * last - before


@wp.kernel
def load(
    # in
    vt_start: wp.array[int],  # (n_vert + 1,)
    vt_corner: wp.array[int],  # (4 n_tet,)
    f_tet: wp.array[wp.vec3],  # (4 n_tet,) [N], elastic forces
    inv_mass: wp.array[float],  # (n_vert,) [1/kg], 0 for a fixed vertex
    gravity: wp.array[wp.vec3],  # (1,) [m/s^2]
    dt: wp.array[float],  # (n_vert,) [s]
    last: wp.array[wp.vec3],  # (n_vert,) [m/s] change by contacts in the last step
    before: wp.array[wp.vec3],  # (n_vert,) [m/s] in the one before it
    # out
    b: wp.array[wp.vec3],  # (n_vert,) [m/s]
):
    """One thread per vertex: what would be added to its velocity without damping."""
    i = wp.tid()
    b[i] = wp.vec3(0.0, 0.0, 0.0)
    if inv_mass[i] > 0.0:
        a = inv_mass[i] * corner_sum(i, vt_start, vt_corner, f_tet) + gravity[0]
        b[i] = dt[i] * a + expected(last[i], before[i])


@wp.kernel
def begin(
    # in
    vt_start: wp.array[int],  # (n_vert + 1,)
    vt_corner: wp.array[int],  # (4 n_tet,)
    f_tet: wp.array[wp.vec3],  # (4 n_tet,) [N], C v
    inv_mass: wp.array[float],  # (n_vert,) [1/kg], 0 for a fixed vertex
    dt: wp.array[float],  # (n_vert,) [s]
    row: wp.array[int],  # (n_vert,) world
    coef: wp.array2d[float],  # (n_world, MOST)
    # in, out
    r: wp.array[wp.vec3],  # (n_vert,) [m/s] b, then r_0
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
):
    """One thread per vertex: the first term of the sum."""
    i = wp.tid()
    if inv_mass[i] > 0.0:
        u = r[i] - dt[i] * inv_mass[i] * corner_sum(i, vt_start, vt_corner, f_tet)
        r[i] = u
        v[i] = v[i] + coef[row[i], 0] * u


@wp.kernel
def go_on(
    # in
    k: int,
    vt_start: wp.array[int],  # (n_vert + 1,)
    vt_corner: wp.array[int],  # (4 n_tet,)
    f_tet: wp.array[wp.vec3],  # (4 n_tet,) [N], C r_{k-1}
    inv_mass: wp.array[float],  # (n_vert,) [1/kg], 0 for a fixed vertex
    dt: wp.array[float],  # (n_vert,) [s]
    row: wp.array[int],  # (n_vert,) world
    reach: wp.array[float],  # (n_world,) Z
    coef: wp.array2d[float],  # (n_world, MOST)
    last: wp.array[wp.vec3],  # (n_vert,) [m/s] r_{k-1}
    # in, out
    r: wp.array[wp.vec3],  # (n_vert,) [m/s] r_{k-2}, then r_k
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
):
    """One thread per vertex: term k of the sum, from 1 on."""
    i = wp.tid()
    if inv_mass[i] > 0.0:
        lr = dt[i] * inv_mass[i] * corner_sum(i, vt_start, vt_corner, f_tet)
        u = last[i] - 2.0 / reach[row[i]] * lr
        if k > 1:
            u = 2.0 * u - r[i]
        r[i] = u
        v[i] = v[i] + coef[row[i], k] * u


@wp.kernel
def finish(
    # in
    dt: wp.array[float],  # (n_vert,) [s]
    last: wp.array[wp.vec3],  # (n_vert,) [m/s] change by contacts in the last step
    before: wp.array[wp.vec3],  # (n_vert,) [m/s] in the one before it
    inv_mass: wp.array[float],  # (n_vert,) [1/kg], 0 for a fixed vertex
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # in, out
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    # out
    free: wp.array[wp.vec3],  # (n_vert,) [m/s] the same, kept
    x_new: wp.array[wp.vec3],  # (n_vert,) [m]
):
    """One thread per vertex: take off what contacts will add, and drift."""
    i = wp.tid()
    u = v[i]
    if inv_mass[i] > 0.0:
        u -= expected(last[i], before[i])
    v[i] = u
    free[i] = u
    x_new[i] = x[i] + dt[i] * u


@wp.kernel
def leave_undamped(
    # in
    undamped: wp.array[int],  # (n_vert,) 1 in worlds without a damped body
    kicked: wp.array[wp.vec3],  # (n_vert,) [m/s] velocities after the forces alone
    dt: wp.array[float],  # (n_vert,) [s]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # out
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    x_new: wp.array[wp.vec3],  # (n_vert,) [m]
):
    """One thread per vertex: in such worlds, move as if no other one were damped."""
    i = wp.tid()
    if undamped[i] > 0:
        u = kicked[i]
        v[i] = u
        x_new[i] = x[i] + dt[i] * u


@wp.kernel
def remember(
    # in
    v: wp.array[wp.vec3],  # (n_vert,) [m/s] at the end of a step
    free: wp.array[wp.vec3],  # (n_vert,) [m/s] the same before the contacts
    # in, out
    last: wp.array[wp.vec3],  # (n_vert,) [m/s] change by contacts in the last step, then in this
    before: wp.array[wp.vec3],  # (n_vert,) [m/s] in the one before it
):
    """One thread per vertex: keep how contacts changed its velocity."""
    i = wp.tid()
    before[i] = last[i]
    last[i] = v[i] - free[i]


@wp.kernel
def scale(
    # in
    by: wp.array[float],  # (n_vert,)
    # in, out
    last: wp.array[wp.vec3],  # (n_vert,) [m/s]
    before: wp.array[wp.vec3],  # (n_vert,) [m/s]
):
    """One thread per vertex: what is expected of a step of another length."""
    i = wp.tid()
    last[i] = by[i] * last[i]
    before[i] = by[i] * before[i]
