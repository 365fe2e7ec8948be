"""What a contact is: five weighted vertices and a direction, its gap and its rotation.

A contact joins a vertex, or a point of an edge, to a point of a triangle or of its edge. The first
two vertices belong to the body that moves along the normal n, the others to the other body. Unused
places repeat a vertex, with weight zero.

    g = (sum a_k x_k) . n - offset        gap of five weighted vertices along a direction   [m]
    b_k                                   how the direction turns with the vertices         [1/m]

When the vertices of a surface move by u_k, its normal turns by -sum b_k (n . u_k). Over a triangle
b_k = grad w_k, the gradient of its weight. Over two edges it is the same in the basis of their
directions.
"""

import warp as wp

from warp_contact.kernels.options import OPTIONS

wp.set_module_options(OPTIONS)


vec5i = wp.types.vector(length=5, dtype=wp.int32)
vec5 = wp.types.vector(length=5, dtype=wp.float32)


@wp.struct
class Contact:
    """A contact as the narrow phase finds it."""

    vert: vec5i
    coef: vec5  # a_k, all 0 for a vertex inside a body that makes no contact
    normal: wp.vec3  # n, 0 where there is no contact
    depth: float  # at detection, 0 for a persistent contact [m]
    offset: float  # of a plane, else 0 [m]
    pair: wp.vec2i  # the two bodies, n_body + p for plane p
    on_plane: bool
    edge_length: float  # mean edge of the first body [m]


@wp.func
def is_of_edge(c: Contact) -> bool:
    """Whether the first side is a point of an edge, not a vertex."""
    return c.vert[1] != c.vert[0]


@wp.func
def meets_edge(c: Contact) -> bool:
    """Whether the other side is a point of an edge, not of a triangle."""
    return c.vert[3] == c.vert[4]


@wp.func
def meets_body(c: Contact) -> bool:
    """Whether there is another side that can move: not so for a plane."""
    return c.vert[2] != c.vert[0]


@wp.func
def gap(c: Contact, x: wp.array[wp.vec3]) -> float:
    """Gap of a contact [m]; relative to one vertex, as float32 is coarse far from the origin."""
    origin = x[c.vert[0]]
    if c.on_plane:
        return wp.dot(origin, c.normal) - c.offset
    r = wp.vec3(0.0, 0.0, 0.0)
    for k in range(5):
        r += c.coef[k] * (x[c.vert[k]] - origin)
    return wp.dot(r, c.normal)


@wp.func
def relative_velocity(c: Contact, v: wp.array[wp.vec3]) -> wp.vec3:
    """Relative velocity of the two sides of a contact [m/s]."""
    u = wp.vec3(0.0, 0.0, 0.0)
    for k in range(5):
        u += c.coef[k] * v[c.vert[k]]
    return u


@wp.func
def gradient(k: int, c: Contact, x: wp.array[wp.vec3]) -> wp.vec3:
    """b_k of a contact between bodies [1/m]."""
    n = c.normal
    p = x[c.vert[0]]
    q = x[c.vert[1]]
    a = x[c.vert[2]]
    b = x[c.vert[3]]
    if meets_edge(c):
        if k == 4:
            return wp.vec3(0.0, 0.0, 0.0)
        along = wp.cross(b - a, n)
        other = q - p
        if k >= 2:
            along = wp.cross(q - p, n)
            other = b - a
        whole = wp.dot(along, other)
        if whole == 0.0:
            return wp.vec3(0.0, 0.0, 0.0)
        if k == 0 or k == 2:
            return -along / whole
        return along / whole
    if k < 2:
        return wp.vec3(0.0, 0.0, 0.0)
    d = x[c.vert[4]]
    whole = wp.dot(n, wp.cross(b - a, d - a))
    if whole == 0.0:
        return wp.vec3(0.0, 0.0, 0.0)
    across = a - b
    if k == 2:
        across = b - d
    if k == 3:
        across = d - a
    return wp.cross(across, n) / whole
