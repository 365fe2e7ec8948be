"""The tangential impulse of a contact: friction across a gap, and the ramps of facets.

The symbols are those of impulse.py.

Friction acts across the gap. Its torque g0 n x p_t would change the angular momentum. So u_t is
taken relative to the turning of the other surface, u_t + g0 sum b_k (n . v_k), and the vertices
receive g0 (b_k . p_t) n in return, with b_k of contact.py.

The torque couples a friction impulse to the normal velocity, by q = sum N_k / m_k a_k g0 b_k, and
to itself, by B = sum N_k / m_k g0^2 |b_k|^2. A vertex far lighter than the rest, or the only free
one, may take more of the torque than of the impulse. Therefore the inverse effective mass is

    W_t = W + (B + sqrt(B^2 + 4 |q|^2)) / 2      bounds the eigenvalues of the contact   [1/kg]

Across a gap that is too wide for the surface to take the torque there is no friction in this step.

Where a vertex meets a facet, n is the direction of the depth. It is smooth over many facets, and
the facet may lean away from it, as a ramp. A vertex that slides up it enters the facet although
u . n = 0. The closure lifts it out, which would add energy. The facet itself would push along its
normal n_f, at x0. So the tangential impulse may point down the ramp as well,

    t = n_f / (n . n_f) - n
    p_t = s t + r,   0 <= s <= lambda,  |r| <= mu lambda       nearest to p_t - u_t / W_t

This stops the climb. It acts against the motion, so it adds no energy. At s = lambda the whole
impulse is along n_f. There is no ramp across a gap too wide for friction, nor at a sharp rim.
"""

import warp as wp

from warp_contact.kernels.mobility import Mobility, mobility_of, row_of
from warp_contact.kernels.narrow_phase.contact import Contact, is_of_edge
from warp_contact.kernels.narrow_phase.contact_graph import ContactGraph, contacts_of
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

UPRIGHT = wp.constant(0.85)  # n . n_f below which a facet is another side of a rim, not a ramp
LEAST_SLOPE = wp.constant(1.0e-3)  # slope below which it is rounding, not a ramp

mat53 = wp.types.matrix(shape=(5, 3), dtype=wp.float32)


@wp.func
def clamped(p: wp.vec3, bound: float) -> wp.vec3:
    """The vector p, shortened to the bound."""
    size = wp.length(p)
    if size > bound:
        return p * (bound / size)
    return p


@wp.func
def allowed(p: wp.vec3, normal: float, mu: float, ramp: wp.vec3) -> wp.vec3:
    """The tangential impulse nearest to p, of those that the normal impulse allows."""
    steep = wp.length_sq(ramp)
    if steep == 0.0:
        return clamped(p, mu * normal)
    up = wp.clamp(wp.dot(p, ramp) / steep, 0.0, normal) * ramp
    return up + clamped(p - up, mu * normal)


@wp.func
def slope(c: Contact, x: wp.array[wp.vec3]) -> wp.vec3:
    """The ramp t of a contact of a vertex with a triangle; 0 for others."""
    none = wp.vec3(0.0, 0.0, 0.0)
    if is_of_edge(c):
        return none
    a = x[c.vert[2]]
    face = wp.normalize(wp.cross(x[c.vert[3]] - a, x[c.vert[4]] - a))
    upright = wp.dot(face, c.normal)
    if upright < UPRIGHT:
        return none
    ramp = face / upright - c.normal
    if wp.length_sq(ramp) < LEAST_SLOPE * LEAST_SLOPE:
        return none
    return ramp


@wp.func
def torque_weight(
    c: Contact, graph: ContactGraph, bodies: Mobility, gap: float, turn: mat53
) -> float:
    """What the torque adds to the bound on the eigenvalues of a contact: W_t - W [1/kg]."""
    q = wp.vec3(0.0, 0.0, 0.0)
    b = float(0.0)
    for k in range(5):
        i = c.vert[k]
        m = row_of(i, bodies)
        if m == 0.0:
            m = mobility_of(i, bodies) * float(contacts_of(i, graph))
        g = gap * turn[k]
        q += m * c.coef[k] * g
        b += m * wp.dot(g, g)
    return 0.5 * (b + wp.sqrt(b * b + 4.0 * wp.dot(q, q)))
