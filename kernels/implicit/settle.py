"""Stage 5, impulses: what bodies that are strained answer to them.

Within the sweeps a body answers impulses p by y = G p, with its stiffness at rest. Its present A
would answer A^-1 p: bodies that are crushed are stiffer, and what they answer too much becomes
energy. What is lacking is

    q = p - A y                                                                       [N s]

Where it is small, the next step makes up for it. Where it is not, A z = q is solved, v and y grow
by z, and the contacts sweep on: a modified Newton iteration, whose fixed point has y = A^-1 p and
no contact that approaches. Momentum is that of p, at every pass.
"""

import warp as wp

from warp_contact.kernels.implicit.bodies import (
    Implicit,
    RigidMotion,
    as_vec3d,
    deforms,
    floats,
    rigid_at,
)
from warp_contact.kernels.options import OPTIONS
from warp_contact.kernels.worlds import FIRST_LOOK, Worlds

wp.set_module_options(OPTIONS)

SMALL = wp.constant(0.2)  # |q| / |p| that the next step makes up for
SMALLER = wp.constant(0.9)  # a pass that leaves more of q is the last one of its body
PASSES = wp.constant(4)  # at most, in a step


@wp.struct
class Settling:
    """Where the passes are."""

    left: wp.array[float]  # (n_body,) |q| / |p| of each body
    passes: wp.array[int]  # (1,) number of the present one


@wp.kernel
def begin(
    # out
    to: Settling,
    unsettled: wp.array[int],  # (1,) bodies that need a pass
):
    """One thread per body: no pass yet."""
    b = wp.tid()
    to.left[b] = wp.inf
    if b == 0:
        to.passes[0] = 0
        unsettled[0] = 0


@wp.kernel
def next_pass(
    # in, out
    to: Settling,
    # out
    unsettled: wp.array[int],  # (1,) bodies that need a pass
):
    """One thread: a pass begins."""
    to.passes[0] = to.passes[0] + 1
    unsettled[0] = 0


@wp.kernel
def find_lacking(
    # in
    d: Implicit,
    p: wp.array[wp.vec3],  # (n_vert,) [N s] of the contacts of this step
    ay: wp.array[wp.vec3],  # (n_vert,) [N s] A y
    attached: wp.array[int],  # (n_body,) 1 for a body that is; empty if none is
    # in, out
    to: Settling,
    worlds: Worlds,  # those with a body that needs a pass are open
    # out
    lacking: wp.array[wp.vec3],  # (n_vert,) [N] q / h where it is small, else 0
    q: wp.array[wp.vec3],  # (n_vert,) [N s] where it needs a pass, else 0
    # out, added to
    unsettled: wp.array[int],  # (1,) bodies that need a pass
):
    """One thread per body: what it lacks, and whether that needs a pass; of attached ones none."""
    b = wp.tid()
    first = d.body_vert[b]
    last = d.body_vert[b + 1]
    if attached.shape[0] > 0:
        if attached[b] != 0:
            for i in range(first, last):
                q[i] = wp.vec3(0.0, 0.0, 0.0)
            return
    given = wp.float64(0.0)
    left = wp.float64(0.0)
    for i in range(first, last):
        s = wp.vec3(0.0, 0.0, 0.0)
        if d.inv_mass[i] > 0.0 and deforms(b, d):
            s = p[i] - ay[i]
            given += wp.length_sq(as_vec3d(p[i]))
        left += wp.length_sq(as_vec3d(s))
        q[i] = s
    ratio = float(0.0)
    if left > wp.float64(0.0):
        ratio = wp.float32(wp.sqrt(left / wp.max(given, left * wp.float64(1.0e-12))))
    again = ratio > SMALL and ratio < SMALLER * to.left[b] and to.passes[0] < PASSES
    to.left[b] = ratio
    if again:
        wp.atomic_add(unsettled, 0, 1)
        worlds.open[worlds.of_vert[first]] = FIRST_LOOK
    for i in range(first, last):
        lacking[i] = wp.vec3(0.0, 0.0, 0.0)
        if ratio <= SMALL:
            lacking[i] = q[i] / d.h[b]
        if not again:
            q[i] = wp.vec3(0.0, 0.0, 0.0)


@wp.kernel
def add_answer(
    # in
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    z: wp.array[wp.vec3],  # (n_vert,) [m/s]
    d: Implicit,
    motion: RigidMotion,  # of z, which is rounding: q has no resultant
    # in, out
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
):
    """One thread per vertex: add z to v."""
    i = wp.tid()
    b = d.vert_body[i]
    if d.inv_mass[i] == 0.0 or not deforms(b, d):
        return
    u = z[i]
    if floats(b, d):
        u -= rigid_at(i, b, x[i], d, motion)
    v[i] = v[i] + u
