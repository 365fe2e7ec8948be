"""After stage 7: bodies keep the angular momentum that displacements by the search would change.

A vertex that moves by d while it has the velocity v changes the angular momentum by m d x v. Each
body gets it back as a rigid rotation about its centre of mass c, which keeps its momentum:

    dL = sum m d x v,   I = sum m (|r|^2 1 - r r^T),  r = x - c,   w = -I^-1 dL        [1/s]
    v_i += w x r_i                                                                     [m/s]

Bodies with fixed vertices are left alone: what holds them takes the angular momentum.
"""

import warp as wp

from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)


@wp.kernel
def lost_spin(
    # in
    body_vert: wp.array[int],  # (n_body + 1,)
    mass: wp.array[float],  # (n_vert,) [kg]
    inv_mass: wp.array[float],  # (n_vert,) [1/kg], 0 for a fixed vertex
    x0: wp.array[wp.vec3],  # (n_vert,) [m] before the search
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    # out
    centre: wp.array[wp.vec3],  # (n_body,) [m]
    spin: wp.array[wp.vec3],  # (n_body,) [1/s]
):
    """One thread per body: the rotation that gives it its angular momentum back.

    Only steps with old overlaps take the time of the largest body in one thread.
    """
    b = wp.tid()
    spin[b] = wp.vec3(0.0, 0.0, 0.0)
    first = body_vert[b]
    last = body_vert[b + 1]
    origin = x[first]
    total = float(0.0)
    moment = wp.vec3(0.0, 0.0, 0.0)
    lost = wp.vec3(0.0, 0.0, 0.0)
    for i in range(first, last):
        if inv_mass[i] == 0.0:
            return
        total += mass[i]
        moment += mass[i] * (x[i] - origin)
        lost += mass[i] * wp.cross(x[i] - x0[i], v[i])
    if wp.length_sq(lost) == 0.0:
        return
    c = origin + moment / total
    inertia = wp.mat33(0.0)
    for i in range(first, last):
        r = x[i] - c
        inertia += mass[i] * (wp.length_sq(r) * wp.identity(n=3, dtype=float) - wp.outer(r, r))
    centre[b] = c
    scale = wp.trace(inertia)
    spin[b] = -(wp.inverse(inertia / scale) * lost) / scale


@wp.kernel
def add_spin(
    # in
    vert_body: wp.array[int],  # (n_vert,)
    centre: wp.array[wp.vec3],  # (n_body,) [m]
    spin: wp.array[wp.vec3],  # (n_body,) [1/s]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    # in, out
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
):
    """One thread per vertex: turn it with its body."""
    i = wp.tid()
    b = vert_body[i]
    if wp.length_sq(spin[b]) > 0.0:
        v[i] = v[i] + wp.cross(spin[b], x[i] - centre[b])
