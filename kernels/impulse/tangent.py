"""What a contact allows its tangential impulse: friction across a gap, and the ramps of facets.

The symbols are those of impulse.py.

Friction acts across the gap, a couple g0 n x p_t that would change the angular momentum. So u_t is
taken relative to the turning of the other surface, u_t + g0 sum b_k (n . v_k), and the vertices
receive g0 (b_k . p_t) n in return, with b_k of contact.py.

The couple ties a friction impulse to the normal velocity, by q = sum N_k / m_k a_k g0 b_k, and to
itself, by B = sum N_k / m_k g0^2 |b_k|^2. A vertex far lighter than the rest, or the only free one,
may take more of the couple than of the impulse, so the sweeps use

    W_c = W + (B + sqrt(B^2 + 4 |q|^2)) / 2      bounds the eigenvalues of the contact   [1/kg]

Across a gap that is too wide for the surface to take the couple there is no friction in this step.

Where a vertex meets a facet, n is the direction of stage 2, smooth over many facets, and the facet
may lean away from it. A vertex that slides up such a ramp goes into the facet although u . n = 0,
and what the closure lifts it out by would be energy from nothing. The facet itself would push along
its normal n_f, at x0, so that the tangential impulse may point down the ramp as well,

    t = n_f / (n . n_f) - n
    p_t = s t + r,   0 <= s <= lambda,  |r| <= mu lambda       nearest to p_t - u_t / W_c

which stops the climb and, as it acts against the motion, adds no energy. At s = lambda the whole
pushes along n_f. There is no ramp across a gap that is too wide for friction, nor at a sharp rim.
"""

import warp as wp

from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

UPRIGHT = wp.constant(0.85)  # n . n_f below which a facet is another side of a rim, not a ramp
LEVEL = wp.constant(1.0e-3)  # slope below which it is none, but rounding


@wp.func
def clamped(p: wp.vec3, bound: float) -> wp.vec3:
    """The vector p, shortened to the bound."""
    size = wp.length(p)
    if size > bound:
        return p * (bound / size)
    return p


@wp.func
def allowed(p: wp.vec3, lam: float, mu: float, ramp: wp.vec3) -> wp.vec3:
    """Of the tangential impulses that a normal one of lam allows, the nearest to p."""
    steep = wp.length_sq(ramp)
    if steep == 0.0:
        return clamped(p, mu * lam)
    up = wp.clamp(wp.dot(p, ramp) / steep, 0.0, lam) * ramp
    return up + clamped(p - up, mu * lam)


@wp.func
def turned(p: wp.vec4, n: wp.vec3, mu: float, ramp: wp.vec3) -> wp.vec4:
    """Tangential and normal impulse of the last step where the normal is n now."""
    along = wp.vec3(p[0], p[1], p[2])
    along = allowed(along - wp.dot(along, n) * n, p[3], mu, ramp)
    return wp.vec4(along[0], along[1], along[2], p[3])


@wp.func
def slope(c: int, vert: wp.array2d[int], n: wp.vec3, x: wp.array[wp.vec3]) -> wp.vec3:
    """The ramp t of contact c of a vertex with a triangle; 0 for others."""
    none = wp.vec3(0.0, 0.0, 0.0)
    if vert[c, 1] != vert[c, 0]:  # an edge
        return none
    a = x[vert[c, 2]]
    face = wp.normalize(wp.cross(x[vert[c, 3]] - a, x[vert[c, 4]] - a))
    upright = wp.dot(face, n)
    if upright < UPRIGHT:
        return none
    ramp = face / upright - n
    if wp.length_sq(ramp) < LEVEL * LEVEL:
        return none
    return ramp


@wp.func
def couple_weight(
    c: int,
    vert: wp.array2d[int],
    coef: wp.array2d[float],
    start: wp.array[int],
    inv_mass: wp.array[float],
    open: wp.array[float],
    turn: wp.array2d[wp.vec3],
) -> float:
    """What the couple of contact c adds to the largest eigenvalue of its matrix, a bound."""
    q = wp.vec3(0.0, 0.0, 0.0)
    b = float(0.0)
    for k in range(5):
        i = vert[c, k]
        m = inv_mass[i] * float(start[i + 1] - start[i])
        g = open[c] * turn[c, k]
        q += m * coef[c, k] * g
        b += m * wp.dot(g, g)
    return 0.5 * (b + wp.sqrt(b * b + 4.0 * wp.dot(q, q)))
