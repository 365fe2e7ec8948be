"""What attached bodies lack of their answer to the impulses of a step."""

import warp as wp

from warp_contact.kernels.implicit.bodies import Implicit, as_vec3d, deforms
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

EASED = wp.constant(0.25)  # part of what attached bodies lack that a step makes up for


@wp.kernel
def make_up(
    # in
    d: Implicit,
    p: wp.array[wp.vec3],  # (n_vert,) [N s] of the contacts and ties of this step
    ay: wp.array[wp.vec3],  # (n_vert,) [N s] A y
    attached: wp.array[int],  # (n_body,) 1 for a body that is attached
    apart: bool,  # nothing touches: other bodies lack nothing
    # in, out
    lacking: wp.array[wp.vec3],  # (n_vert,) [N]
):
    """One thread per body: add a part of p - A y to what an attached one was lacking.

    Where the body is softer than at rest it answers that by more than itself, which its ties take
    up again: so only a part is made up for in each step, less where it is large against p.
    """
    b = wp.tid()
    first = d.body_vert[b]
    last = d.body_vert[b + 1]
    if attached[b] == 0 or not deforms(b, d):
        if apart:
            for i in range(first, last):
                lacking[i] = wp.vec3(0.0, 0.0, 0.0)
        return
    given = wp.float64(0.0)
    left = wp.float64(0.0)
    for i in range(first, last):
        if d.inv_mass[i] > 0.0:
            given += wp.length_sq(as_vec3d(p[i]))
            left += wp.length_sq(as_vec3d(p[i] - ay[i]))
    part = float(0.0)
    if left < given:
        part = EASED * wp.min(2.0 - 2.0 * wp.sqrt(wp.float32(left / given)), 1.0) / d.h[b]
    for i in range(first, last):
        if d.inv_mass[i] > 0.0:
            lacking[i] = (1.0 - EASED) * lacking[i] + part * (p[i] - ay[i])
