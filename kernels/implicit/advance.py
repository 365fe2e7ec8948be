"""The drift of bodies that take implicit steps: their rigid motion is exact, whatever its speed.

    c' = c + h v_l,   x' = c' + Q (r + h u),   v' = v_l + w' x r' + Q u                 [m], [m/s]

v_l and w are linear and angular velocity, u is the rest of v, Q the rotation by h (w + w') / 2,
and w' gives the body the angular momentum that it had. Straight lines would make a body that spins
grow, and a stiff one would turn that into energy.
"""

import warp as wp

from warp_contact.kernels.implicit.bodies import (
    RIGID,
    Implicit,
    RigidMotion,
    as_mat33,
    as_vec3,
    as_vec3d,
    floats,
    moves,
)
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

ROUNDS = wp.constant(3)  # of the mean of w and w'


@wp.struct
class Drift:
    """How each body turns in a step."""

    turn: wp.array[wp.mat33]  # (n_body,) Q
    w: wp.array[wp.vec3]  # (n_body,) [1/s] w'


@wp.func
def rotation(a: wp.vec3d) -> wp.mat33d:
    """Rotation by the vector a (Rodrigues)."""
    one = wp.float64(1.0)
    sq = wp.dot(a, a)
    s = one - sq / wp.float64(6.0)
    c = wp.float64(0.5) - sq / wp.float64(24.0)
    if sq > wp.float64(1.0e-4):
        t = wp.sqrt(sq)
        s = wp.sin(t) / t
        c = (one - wp.cos(t)) / sq
    k = wp.skew(a)
    return wp.identity(n=3, dtype=wp.float64) + s * k + c * (k @ k)


@wp.kernel
def find_drift(
    # in
    dt: wp.array[float],  # (n_vert,) [s]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    d: Implicit,
    motion: RigidMotion,  # of v
    # out
    to: Drift,
):
    """One thread per body: its rotation in this step, and its rate at the end."""
    b = wp.tid()
    if not moves(b, d) or not floats(b, d):
        return
    first = d.body_vert[b]
    last = d.body_vert[b + 1]
    h = wp.float64(dt[first])
    c = d.centre[b]
    w = motion.w[b]
    spin = wp.vec3d()
    rest = wp.vec3d()
    inertia = wp.mat33d()
    for i in range(first, last):
        m = wp.float64(d.mass[i])
        r = x[i] - c
        u = v[i] - motion.v[b] - wp.cross(w, r)
        if d.kind[b] == RIGID:  # rounding
            u = wp.vec3(0.0, 0.0, 0.0)
        q = as_vec3d(r) + h * as_vec3d(u)
        inertia += m * (wp.dot(q, q) * wp.identity(n=3, dtype=wp.float64) - wp.outer(q, q))
        spin += m * wp.cross(as_vec3d(r), as_vec3d(v[i] - motion.v[b]))
        rest += m * wp.cross(q, as_vec3d(u))
    scale = wp.trace(inertia)
    inverse = wp.inverse(inertia / scale)
    before = as_vec3d(w)
    after = before
    turn = rotation(h * before)
    for _ in range(ROUNDS):
        turn = rotation(wp.float64(0.5) * h * (before + after))
        back = wp.transpose(turn)
        after = turn * (inverse * (back * spin - rest)) / scale
    to.w[b] = as_vec3(after)
    to.turn[b] = as_mat33(turn)


@wp.kernel
def advance(
    # in
    dt: wp.array[float],  # (n_vert,) [s]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    d: Implicit,
    motion: RigidMotion,  # of v
    to: Drift,
    turned: bool,  # whether v becomes that at the new positions
    # in, out
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    # out
    x_new: wp.array[wp.vec3],  # (n_vert,) [m], may be x
):
    """One thread per vertex: drift."""
    i = wp.tid()
    b = d.vert_body[i]
    h = dt[i]
    if not moves(b, d) or not floats(b, d):
        x_new[i] = x[i] + h * v[i]
        return
    r = x[i] - d.centre[b]
    u = v[i] - motion.v[b] - wp.cross(motion.w[b], r)
    if d.kind[b] == RIGID:
        u = wp.vec3(0.0, 0.0, 0.0)
    # What is added is small against x, and is therefore added last.
    q = r + h * u
    moved = to.turn[b] * q
    x_new[i] = x[i] + (h * motion.v[b] + (moved - r))
    if turned:
        v[i] = motion.v[b] + wp.cross(to.w[b], moved) + to.turn[b] * u
