"""When a moving point crosses a moving triangle.

A point goes from p0 to p1 while a triangle goes from (a0, b0, c0) to (a1, b1, c1), all of them
straight and at constant speed. With u = p - a, v = b - a, w = c - a [m] the point is in the plane
of the triangle where

    f(s) = u(s) . (v(s) x w(s)) = 0,   0 <= s <= 1      [m^3], a cubic (Provot 1997)

It enters where f falls and leaves where f rises.
"""

import warp as wp

from warp_contact.kernels.geometry import GROWN, NONE
from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)

HALVINGS = wp.constant(24)  # of an interval, down to the rounding of its end


@wp.struct
class Relative:
    """Point, second and third corner against the first corner, at s = 0 and s = 1 [m]."""

    u0: wp.vec3
    u1: wp.vec3
    v0: wp.vec3
    v1: wp.vec3
    w0: wp.vec3
    w1: wp.vec3


@wp.func
def between(a: wp.vec3, b: wp.vec3, s: float) -> wp.vec3:
    return (1.0 - s) * a + s * b  # exact at both ends: the next call starts where this one ended


@wp.func
def height(r: Relative, s: float) -> float:
    """f(s): above zero outside [m^3]."""
    n = wp.cross(between(r.v0, r.v1, s), between(r.w0, r.w1, s))
    return wp.dot(between(r.u0, r.u1, s), n)


@wp.func
def turning(r: Relative) -> wp.vec2:
    """Extrema of f in ascending order; 0 or 1 for one outside (0, 1)."""
    du = r.u1 - r.u0
    dv = r.v1 - r.v0
    dw = r.w1 - r.w0
    n0 = wp.cross(r.v0, r.w0)
    n1 = wp.cross(dv, r.w0) + wp.cross(r.v0, dw)
    n2 = wp.cross(dv, dw)
    c = wp.dot(du, n0) + wp.dot(r.u0, n1)  # f' = a s^2 + b s + c
    b = 2.0 * (wp.dot(r.u0, n2) + wp.dot(du, n1))
    a = 3.0 * wp.dot(du, n2)
    d = b * b - 4.0 * a * c
    if d <= 0.0:
        return wp.vec2(0.0, 1.0)
    q = -0.5 * (b + wp.sqrt(d))
    if b < 0.0:
        q = -0.5 * (b - wp.sqrt(d))
    first = float(1.0)
    if wp.abs(q) < wp.abs(a):
        first = wp.clamp(q / a, 0.0, 1.0)
    second = float(1.0)
    if wp.abs(c) < wp.abs(q):
        second = wp.clamp(c / q, 0.0, 1.0)
    return wp.vec2(wp.min(first, second), wp.max(first, second))


@wp.func
def within(r: Relative, s: float) -> bool:
    """Whether the point projects into the triangle."""
    u = between(r.u0, r.u1, s)
    v = between(r.v0, r.v1, s)
    w = between(r.w0, r.w1, s)
    n = wp.cross(v, w)
    area2 = wp.dot(n, n)
    b = wp.dot(wp.cross(u, w), n)
    c = wp.dot(wp.cross(v, u), n)
    least = -GROWN * area2
    return area2 > 0.0 and b >= least and c >= least and area2 - b - c >= least


@wp.func
def crossing_time(r: Relative, low: float, high: float) -> float:
    """When the point crosses the triangle where f is monotonic; NONE if it does not."""
    outside = height(r, low) >= 0.0
    if outside == (height(r, high) >= 0.0):
        return NONE
    lo = float(low)
    hi = float(high)
    for _halving in range(HALVINGS):
        mid = 0.5 * (lo + hi)
        if (height(r, mid) >= 0.0) == outside:
            lo = mid
        else:
            hi = mid
    if within(r, hi):
        return hi
    return NONE
