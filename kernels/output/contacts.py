"""The contacts of a step as arrays of the device, without gaps: what a user's own kernels read.

Vertices inside a body that make no contact are left out, in the order of the others.
"""

import warp as wp

from warp_contact.kernels.impulse.constraint import Impulse
from warp_contact.kernels.narrow_phase.contact import Contact, gap, relative_velocity, vec5, vec5i
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)


@wp.struct
class ContactArrays:
    """Contacts of the last step on the device, the fields of ``Contacts``.

    Only the first ``n[0]`` entries are contacts. An argument of a kernel may be of this type.
    """

    n: wp.array[int]  # (1,)
    bodies: wp.array[wp.vec2i]  # (capacity,) n_body + p for plane p
    vertices: wp.array[vec5i]  # (capacity,) two of the first body, three of the second
    weights: wp.array[vec5]  # (capacity,)
    point: wp.array[wp.vec3]  # (capacity,) [m]
    normal: wp.array[wp.vec3]  # (capacity,) unit, out of the second body
    gap: wp.array[float]  # (capacity,) [m], negative for an overlap
    normal_impulse: wp.array[float]  # (capacity,) [N s]
    friction_impulse: wp.array[wp.vec3]  # (capacity,) [N s], on the first body
    normal_force: wp.array[float]  # (capacity,) [N]
    friction_force: wp.array[wp.vec3]  # (capacity,) [N], on the first body
    slip: wp.array[wp.vec3]  # (capacity,) [m/s]


@wp.kernel
def mark_contacts(
    # in
    n_contact: wp.array[int],  # (1,)
    contact: wp.array[Contact],  # (capacity,)
    n_kept: wp.array[int],  # (1,) -1 where none are kept
    kept: wp.array[Contact],  # (capacity,) in place of the others where some are
    # out
    made: wp.array[int],  # (capacity + 1,) 1 for a contact, else 0
):
    """One thread per place, and one behind them: whether it holds a contact."""
    c = wp.tid()
    found = int(0)
    n = n_contact[0]
    if n_kept[0] >= 0:
        n = n_kept[0]
    if c < n:
        at = contact[c]
        if n_kept[0] >= 0:
            at = kept[c]
        for k in range(5):
            if at.coef[k] != 0.0:
                found = 1
    made[c] = found


@wp.kernel
def write_contacts(
    # in
    contact: wp.array[Contact],  # (capacity,)
    impulse: wp.array[Impulse],  # (capacity,)
    n_kept: wp.array[int],  # (1,) -1 where none are kept
    kept: wp.array[Contact],  # (capacity,) in place of the others where some are
    kept_impulse: wp.array[Impulse],  # (capacity,)
    before: wp.array[int],  # (capacity + 1,) contacts before each place
    dt: wp.array[float],  # (n_vert,) [s]
    x: wp.array[wp.vec3],  # (n_vert,) [m]
    v: wp.array[wp.vec3],  # (n_vert,) [m/s]
    # out
    to: ContactArrays,
):
    """One thread per place: the contact in it, and what it exchanged."""
    c = wp.tid()
    if c == 0:
        to.n[0] = before[contact.shape[0]]
    k = before[c]
    if before[c + 1] == k:
        return
    at = contact[c]
    p = impulse[c]
    if n_kept[0] >= 0:
        at = kept[c]
        p = kept_impulse[c]
    h = dt[at.vert[0]]
    u = relative_velocity(at, v)
    to.bodies[k] = at.pair
    to.vertices[k] = at.vert
    to.weights[k] = at.coef
    to.point[k] = at.coef[0] * x[at.vert[0]] + at.coef[1] * x[at.vert[1]]
    to.normal[k] = at.normal
    to.gap[k] = gap(at, x)
    to.normal_impulse[k] = p.normal
    to.friction_impulse[k] = p.friction
    to.normal_force[k] = p.normal / h
    to.friction_force[k] = p.friction / h
    to.slip[k] = u - wp.dot(u, at.normal) * at.normal
