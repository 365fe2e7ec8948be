"""Points, segments, triangles and tets: pure functions of positions [m].

barycentric weights of a point in a tet     x = sum b_k x_k,  sum b_k = 1
segment p + t (q - p) against a triangle    Moeller & Trumbore 1997
closest point of a triangle                 Ericson 2005, section 5.1.5
closest points of two lines                 Ericson 2005, section 5.1.9
"""

import warp as wp

from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

# Triangles are enlarged by this fraction for segments. One through the common edge of two triangles
# must hit at least one of them; one from a vertex in the speculative margin must hit the next face.
GROWN = wp.constant(1.0e-5)
PARALLEL = wp.constant(1.0e-7)  # sine that float32 cannot tell from zero
NONE = wp.constant(1.0e30)  # "no hit" for a distance or a parameter


@wp.func
def tet_weights(x: wp.vec3, a: wp.vec3, b: wp.vec3, c: wp.vec3, d: wp.vec3) -> wp.vec4:
    """Barycentric weights of x; all -1 where the tet is flat or inverted."""
    e1 = b - a
    e2 = c - a
    e3 = d - a
    r = x - a
    n = wp.cross(e2, e3)
    det = wp.dot(e1, n)
    if det <= 0.0:
        return wp.vec4(-1.0, -1.0, -1.0, -1.0)
    w1 = wp.dot(r, n) / det
    w2 = wp.dot(r, wp.cross(e3, e1)) / det
    w3 = wp.dot(r, wp.cross(e1, e2)) / det
    return wp.vec4(1.0 - w1 - w2 - w3, w1, w2, w3)


@wp.func
def area_vector(a: wp.vec3, b: wp.vec3, c: wp.vec3) -> wp.vec3:
    """Normal of a triangle with the length of its area [m^2]."""
    return 0.5 * wp.cross(b - a, c - a)


@wp.func
def segment_hit(
    p: wp.vec3, u: wp.vec3, a: wp.vec3, b: wp.vec3, c: wp.vec3, grazing: float
) -> wp.vec3:
    """Parameter t and weights (v, w) of b and c where p + t u meets the triangle's plane.

    t is NONE when the line misses the triangle, or the sine of its angle to the plane is at most
    ``grazing``.
    """
    e1 = b - a
    e2 = c - a
    g = wp.cross(u, e2)
    det = wp.dot(e1, g)
    size = wp.length(wp.cross(e1, e2)) * wp.length(u)
    if wp.abs(det) <= grazing * size:
        return wp.vec3(NONE, 0.0, 0.0)
    r = p - a
    v = wp.dot(r, g) / det
    k = wp.cross(r, e1)
    w = wp.dot(u, k) / det
    if v < -GROWN or w < -GROWN or v + w > 1.0 + GROWN:
        return wp.vec3(NONE, 0.0, 0.0)
    return wp.vec3(wp.dot(e2, k) / det, v, w)


@wp.func
def triangle_closest(x: wp.vec3, a: wp.vec3, b: wp.vec3, c: wp.vec3) -> wp.vec3:
    """Barycentric weights of the point of the triangle that is closest to x."""
    ab = b - a
    ac = c - a
    ax = x - a
    d1 = wp.dot(ab, ax)
    d2 = wp.dot(ac, ax)
    if d1 <= 0.0 and d2 <= 0.0:
        return wp.vec3(1.0, 0.0, 0.0)
    bx = x - b
    d3 = wp.dot(ab, bx)
    d4 = wp.dot(ac, bx)
    if d3 >= 0.0 and d4 <= d3:
        return wp.vec3(0.0, 1.0, 0.0)
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        t = d1 / (d1 - d3)
        return wp.vec3(1.0 - t, t, 0.0)
    cx = x - c
    d5 = wp.dot(ab, cx)
    d6 = wp.dot(ac, cx)
    if d6 >= 0.0 and d5 <= d6:
        return wp.vec3(0.0, 0.0, 1.0)
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        t = d2 / (d2 - d6)
        return wp.vec3(1.0 - t, 0.0, t)
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        t = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return wp.vec3(0.0, 1.0 - t, t)
    s = va + vb + vc
    return wp.vec3(va / s, vb / s, vc / s)


@wp.func
def lines_closest(p: wp.vec3, q: wp.vec3, a: wp.vec3, b: wp.vec3) -> wp.vec2:
    """Parameters (s, u) of the closest points of the lines pq and ab; -1 if parallel."""
    d1 = q - p
    d2 = b - a
    r = p - a
    e11 = wp.dot(d1, d1)
    e22 = wp.dot(d2, d2)
    e12 = wp.dot(d1, d2)
    det = e11 * e22 - e12 * e12
    if det <= 1.0e-6 * e11 * e22:
        return wp.vec2(-1.0, -1.0)
    f1 = wp.dot(d1, r)
    f2 = wp.dot(d2, r)
    return wp.vec2((e12 * f2 - f1 * e22) / det, (e11 * f2 - e12 * f1) / det)


@wp.func
def projected_weights(x: wp.vec3, n: wp.vec3, a: wp.vec3, b: wp.vec3, c: wp.vec3) -> wp.vec3:
    """Barycentric weights where the line x + t n meets the triangle's plane."""
    whole = wp.dot(n, wp.cross(b - a, c - a))
    if whole == 0.0:
        return wp.vec3(1.0, 1.0, 1.0) / 3.0
    wa = wp.dot(n, wp.cross(b - x, c - x)) / whole
    wb = wp.dot(n, wp.cross(c - x, a - x)) / whole
    return wp.vec3(wa, wb, 1.0 - wa - wb)


@wp.func
def projected_crossing(p: wp.vec3, q: wp.vec3, a: wp.vec3, b: wp.vec3, n: wp.vec3) -> wp.vec2:
    """Parameters (s, u) where the lines pq and ab cross when seen along n."""
    det = wp.dot(n, wp.cross(q - p, b - a))
    if det == 0.0:
        return wp.vec2(0.5, 0.5)
    return wp.vec2(wp.dot(n, wp.cross(a - p, b - a)) / det, wp.dot(n, wp.cross(a - p, q - p)) / det)


@wp.func
def boxes_meet(alo: wp.vec3, ahi: wp.vec3, blo: wp.vec3, bhi: wp.vec3) -> bool:
    return (
        alo[0] <= bhi[0]
        and blo[0] <= ahi[0]
        and alo[1] <= bhi[1]
        and blo[1] <= ahi[1]
        and alo[2] <= bhi[2]
        and blo[2] <= ahi[2]
    )


@wp.func
def in_box(x: wp.vec3, lo: wp.vec3, hi: wp.vec3) -> bool:
    return boxes_meet(x, x, lo, hi)
