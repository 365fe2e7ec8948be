"""Stage 1 of bodies that take implicit steps.

    A dv = P^T (h (f + l - C v) - T h^2 K u),   v' = v + P dv + h (g + a)   without fixed vertices
    A dv = h (f + l - C v + m g) - T h^2 K u,   v' = v + dv                 with some [kg m/s]
    u = v - G (M v - (A v_c))                   motion that the step does not resolve  [m/s]

f are the internal forces at x, l is what was lacking (settle.py), a comes of forces from outside,
v_c are the velocities of fixed vertices. With T = 0 the step is the
trapezoidal rule for small motions (Newmark 1959, beta = 1/4 to 1/2): it damps nothing, and what is
faster than the step may gain energy where shapes change. u is what an implicit step would take out
of v: all of a motion with z = (h omega)^2 >> 1, a part z of one with z << 1. T = 1 damps it by
1 - z^2 a step for z << 1 and by 2 / z for z >> 1. A body without fixed vertices gets its rigid
motion from outside forces alone: internal ones have no resultant, and rounding gives them none.
A rigid one has no other.
"""

import warp as wp

from warp_contact.kernels.implicit.bodies import (
    HELD,
    Implicit,
    RigidMotion,
    acceleration,
    deforms,
    floats,
    is_pushed,
    moves,
    rigid_at,
)
from warp_contact.kernels.motion.motion import corner_sum
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

DAMPED = wp.constant(1.0)  # T: how much of what is not resolved is damped


@wp.kernel
def sum_forces(
    # in
    vt_start: wp.array[int],  # (n_vert + 1,)
    vt_corner: wp.array[int],  # (4 n_tet,)
    f_tet: wp.array[wp.vec3],  # (4 n_tet,) [N]
    damped: wp.array[wp.vec3],  # (4 n_tet,) corners of C v [N]; empty without damping
    d: Implicit,
    # out
    f: wp.array[wp.vec3],  # (n_vert,) [N]
):
    """One thread per vertex: f - C v."""
    i = wp.tid()
    f[i] = wp.vec3(0.0, 0.0, 0.0)
    if d.inv_mass[i] > 0.0 and deforms(d.vert_body[i], d):
        f[i] = corner_sum(i, vt_start, vt_corner, f_tet)
        if damped.shape[0] > 0:
            f[i] = f[i] - corner_sum(i, vt_start, vt_corner, damped)


@wp.kernel
def at_fixed(
    # in
    d: Implicit,
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    # out
    v_c: wp.array[wp.vec3],  # (n_vert,) [m/s]
):
    """One thread per vertex: the velocities of fixed vertices of bodies that are held."""
    i = wp.tid()
    v_c[i] = wp.vec3(0.0, 0.0, 0.0)
    if d.inv_mass[i] == 0.0 and d.kind[d.vert_body[i]] == HELD:
        v_c[i] = v[i]


@wp.kernel
def momenta(
    # in
    d: Implicit,
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    of_fixed: wp.array[wp.vec3],  # (n_vert,) [kg m/s] A v_c; empty where nothing is held
    # out
    p: wp.array[wp.vec3],  # (n_vert,) [kg m/s]
):
    """One thread per vertex: M v - A v_c."""
    i = wp.tid()
    p[i] = wp.vec3(0.0, 0.0, 0.0)
    if d.inv_mass[i] > 0.0 and deforms(d.vert_body[i], d):
        p[i] = d.mass[i] * v[i]
        if of_fixed.shape[0] > 0:
            p[i] = p[i] - of_fixed[i]


@wp.kernel
def difference(
    # in
    d: Implicit,
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    other: wp.array[wp.vec3],  # (n_vert,) [m/s]
    # out
    u: wp.array[wp.vec3],  # (n_vert,) [m/s]
):
    """One thread per vertex: v - other where a body deforms, else 0."""
    i = wp.tid()
    u[i] = wp.vec3(0.0, 0.0, 0.0)
    if d.inv_mass[i] > 0.0 and deforms(d.vert_body[i], d):
        u[i] = v[i] - other[i]


@wp.kernel
def load(
    # in
    vt_start: wp.array[int],  # (n_vert + 1,)
    vt_corner: wp.array[int],  # (4 n_tet,)
    stiff: wp.array[wp.vec3],  # (4 n_tet,) corners of K u [N/s]
    f: wp.array[wp.vec3],  # (n_vert,) [N]
    lacking: wp.array[wp.vec3],  # (n_vert,) [N] see settle.py
    gravity: wp.array[wp.vec3],  # (1,) [m/s^2]
    d: Implicit,
    # out
    r: wp.array[wp.vec3],  # (n_vert,) [kg m/s]
):
    """One thread per vertex: the right-hand side, still with the rigid part of rounding."""
    i = wp.tid()
    b = d.vert_body[i]
    r[i] = wp.vec3(0.0, 0.0, 0.0)
    if d.inv_mass[i] > 0.0 and deforms(b, d):
        h = d.h[b]
        s = h * f[i] - DAMPED * h * h * corner_sum(i, vt_start, vt_corner, stiff) + h * lacking[i]
        if d.kind[b] == HELD:
            s += h * d.mass[i] * gravity[0]
        r[i] = s


@wp.kernel
def remove_rigid(
    # in
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    d: Implicit,
    motion: RigidMotion,  # by r
    # in, out
    r: wp.array[wp.vec3],  # (n_vert,) [kg m/s]
):
    """One thread per vertex: P^T r."""
    i = wp.tid()
    b = d.vert_body[i]
    if deforms(b, d) and floats(b, d):
        r[i] = r[i] - d.mass[i] * rigid_at(i, b, x[i], d, motion)


@wp.kernel
def kick(
    # in
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    dv: wp.array[wp.vec3],  # (n_vert,) [m/s] of a whole step
    gravity: wp.array[wp.vec3],  # (1,) [m/s^2]
    dt: wp.array[float],  # (n_vert,) [s] h, or a part of it
    d: Implicit,
    motion: RigidMotion,  # of dv
    # in, out
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
):
    """One thread per vertex: add dv in the time dt; to a lumped body only forces from outside."""
    i = wp.tid()
    b = d.vert_body[i]
    if is_pushed(b, d):
        v[i] = v[i] + dt[i] * acceleration(i, b, x[i], d)
    if d.inv_mass[i] == 0.0 or not moves(b, d):
        return
    u = dv[i]
    if floats(b, d):
        u += d.h[b] * (gravity[0] + acceleration(i, b, x[i], d)) - rigid_at(i, b, x[i], d, motion)
    v[i] = v[i] + (dt[i] / d.h[b]) * u


@wp.kernel
def push(
    # in
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    dt: wp.array[float],  # (n_vert,) [s]
    part: float,  # of it
    d: Implicit,
    # in, out
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
):
    """One thread per vertex: let what acts from outside act for a part of the time dt."""
    i = wp.tid()
    b = d.vert_body[i]
    if is_pushed(b, d) or (moves(b, d) and floats(b, d)):
        v[i] = v[i] + part * dt[i] * acceleration(i, b, x[i], d)
