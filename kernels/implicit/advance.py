"""The drift of bodies that take implicit steps: their rigid motion is exact, whatever its speed.

    c' = c + h v_l,   x' = c' + Q (r + h u),   v' = v_l + w' x r' + Q u                 [m], [m/s]

v_l and w are linear and angular velocity, u is the rest of v, Q the rotation by h (w + w') / 2,
and w' gives the body the angular momentum that it had. Straight lines would make a body that spins
grow, and a stiff one would turn that into energy. A rigid body, R q at c at the start of the step,
gets its shape back, whatever rounding does:

    x' = c' + R' q,  R' = Q R,   v' = v_l + w' x R' q                                 [m], [m/s]
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
    rotation,
)
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

ROUNDS = wp.constant(3)  # of the mean of w and w'


@wp.struct
class Drift:
    """How each body turns in a step."""

    turn: wp.array[wp.mat33]  # (n_body,) Q
    w: wp.array[wp.vec3]  # (n_body,) [1/s] w'
    centre: wp.array[wp.vec3d]  # (n_body,) [m] c' of rigid bodies, empty where there is none
    lies: wp.array[wp.mat33d]  # (n_body,) R' of the same
    rate: wp.array[wp.vec3d]  # (n_body,) [1/s] w' of the same


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
    before = as_vec3d(w)
    if d.kind[b] == RIGID:
        before = d.solids.w[b]
        lies = d.solids.turn[b]
        inertia = lies @ d.solids.inertia[b] @ wp.transpose(lies)
        spin = inertia * before
    else:
        for i in range(first, last):
            m = wp.float64(d.mass[i])
            r = x[i] - c
            u = v[i] - motion.v[b] - wp.cross(w, r)
            q = as_vec3d(r) + h * as_vec3d(u)
            inertia += m * (wp.dot(q, q) * wp.identity(n=3, dtype=wp.float64) - wp.outer(q, q))
            spin += m * wp.cross(as_vec3d(r), as_vec3d(v[i] - motion.v[b]))
            rest += m * wp.cross(q, as_vec3d(u))
    scale = wp.trace(inertia)
    inverse = wp.inverse(inertia / scale)
    after = before
    turn = rotation(h * before)
    for _ in range(ROUNDS):
        turn = rotation(wp.float64(0.5) * h * (before + after))
        back = wp.transpose(turn)
        after = turn * (inverse * (back * spin - rest)) / scale
    to.w[b] = as_vec3(after)
    to.turn[b] = as_mat33(turn)
    if d.kind[b] == RIGID:
        lies = d.solids.turn[b]
        at = d.solids.at[b] - lies * d.solids.middle[b]
        to.centre[b] = at + h * d.solids.v[b]
        to.lies[b] = turn @ lies
        to.rate[b] = after


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
    if d.kind[b] == RIGID:
        arm = to.lies[b] * as_vec3d(d.rest[i])
        x_new[i] = as_vec3(to.centre[b] + arm)
        if turned:
            v[i] = as_vec3(d.solids.v[b] + wp.cross(to.rate[b], arm))
        return
    r = x[i] - d.centre[b]
    u = v[i] - motion.v[b] - wp.cross(motion.w[b], r)
    # What is added is small against x, and is therefore added last.
    q = r + h * u
    moved = to.turn[b] * q
    x_new[i] = x[i] + (h * motion.v[b] + (moved - r))
    if turned:
        v[i] = motion.v[b] + wp.cross(to.w[b], moved) + to.turn[b] * u
